#include "depthservo/sequence/VideoSource.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "depthservo/sequence/SequenceWriter.h"
#include "depthservo/text/InputError.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;

enum class Kind { camera, stream, series, file };

Kind kindOf(const std::string& source) {
  if (source.find_first_not_of("0123456789") == std::string::npos) return Kind::camera;
  if (source.find("://") != std::string::npos) return Kind::stream;
  std::error_code error;
  if (fs::is_character_file(source, error)) return Kind::camera;
  return source.find('%') != std::string::npos ? Kind::series : Kind::file;
}

[[noreturn]] void refuse(const std::string& source, const std::string& message) {
  throw InputError({source.empty() ? "--source" : source, 0, ""}, message);
}

void requireFile(const std::string& source, Kind kind) {
  std::error_code error;
  if (source.empty()) refuse(source, "expected a camera, a video file or a series of images");
  if (source.compare(0, 5, "/dev/") == 0 && !fs::exists(source, error)) {
    refuse(source, "there is no such camera");
  }
  if (kind != Kind::file) return;
  if (fs::is_directory(source, error)) {
    refuse(source, "is a folder; give its images as FOLDER/%06d.png, or use replay");
  }
  if (!fs::is_regular_file(source, error)) refuse(source, "there is no such file");
}

}  // namespace

struct VideoSource::Capture {
  std::string source;
  Kind kind;
  VideoOptions options;
  cv::VideoCapture video;
  double fps = 0;
  std::size_t taken = 0;
  cv::Mat frame;
  std::string why;

  bool isLive() const { return kind == Kind::camera || kind == Kind::stream; }

  double time_s() const {
    if (isLive()) {
      const auto now = std::chrono::system_clock::now().time_since_epoch();
      return std::chrono::duration<double>(now).count() - options.latency_s;
    }
    if (!options.times.empty()) return options.times[taken];
    return fileTime(options.start_s + static_cast<double>(taken) / fps);
  }
};

VideoSource::VideoSource(const std::string& source, const VideoOptions& options)
    : capture_(new Capture{source, kindOf(source), options, {}, 0, 0, {}, ""}) {
  Capture& c = *capture_;
  requireFile(source, c.kind);
  try {
    switch (c.kind) {
      case Kind::camera:
        if (source.find('/') == std::string::npos && source.size() < 4) {
          c.video.open(std::stoi(source), cv::CAP_V4L2);
        } else {
          c.video.open(source, cv::CAP_V4L2);
        }
        break;
      case Kind::series:
        c.video.open(source, cv::CAP_IMAGES);
        break;
      case Kind::stream:
      case Kind::file:
        c.video.open(source, cv::CAP_FFMPEG);
        if (!c.video.isOpened()) c.video.open(source);
        break;
    }
  } catch (const cv::Exception&) {
  }
  if (!c.video.isOpened()) {
    refuse(source, c.kind == Kind::camera   ? "there is no camera that can be opened"
                   : c.kind == Kind::series ? "there is no first image of this name (number 0 or 1)"
                                            : "is no video that OpenCV can read");
  }
  if (c.kind == Kind::camera) {
    if (options.width > 0) c.video.set(cv::CAP_PROP_FRAME_WIDTH, options.width);
    if (options.height > 0) c.video.set(cv::CAP_PROP_FRAME_HEIGHT, options.height);
    if (options.fps > 0) c.video.set(cv::CAP_PROP_FPS, options.fps);
    c.video.set(cv::CAP_PROP_BUFFERSIZE, 1);
  }
  const double told = c.kind == Kind::series ? 0 : c.video.get(cv::CAP_PROP_FPS);
  c.fps = options.fps > 0 ? options.fps : std::isfinite(told) && told > 0 ? told : 0;
  if (!c.isLive() && options.times.empty() && c.fps == 0) {
    refuse(source, "says nothing of its frame rate; give --fps or --times");
  }
}

VideoSource::~VideoSource() = default;

bool VideoSource::isLive() const { return capture_->isLive(); }
std::string VideoSource::whyEnded() const { return capture_->why; }
double VideoSource::fps() const { return capture_->fps; }

bool VideoSource::next(TimedImage& image) {
  Capture& c = *capture_;
  if (!c.isLive() && !c.options.times.empty() && c.taken == c.options.times.size()) {
    c.why = "no more times";
    return false;
  }
  bool hasImage = false;
  try {
    hasImage = c.video.read(c.frame) && !c.frame.empty() && c.frame.depth() == CV_8U;
  } catch (const cv::Exception&) {
  }
  if (!hasImage) {
    c.why = c.isLive() ? "the camera gives no more images" : "end of the file";
    return false;
  }
  image.time_s = c.time_s();
  ++c.taken;
  image.image.resize(static_cast<unsigned>(c.frame.rows), static_cast<unsigned>(c.frame.cols));
  cv::Mat gray(c.frame.rows, c.frame.cols, CV_8U, image.image.bitmap);
  if (c.frame.channels() == 1) {
    c.frame.copyTo(gray);
  } else {
    cv::cvtColor(c.frame, gray, c.frame.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
  }
  return true;
}

}  // namespace depthservo
