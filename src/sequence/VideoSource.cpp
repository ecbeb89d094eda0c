#include "depthservo/sequence/VideoSource.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>

#include "depthservo/sequence/Sequence.h"
#include "depthservo/sequence/SequenceWriter.h"
#include "depthservo/text/InputError.h"
#include "sequence/ImageFile.h"
#include "sequence/ImagePipe.h"
#include "sequence/ImageSeries.h"
#include "sequence/systemTime.h"
#include "sequence/videoModule.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using detail::VideoReader;
using detail::VideoRequest;

[[noreturn]] void refuse(const std::string& source, const std::string& message) {
  throw InputError({source.empty() ? "--source" : source, 0, ""}, message);
}

bool isSeries(const std::string& source) {
  return source.find("://") == std::string::npos && source.find('%') != std::string::npos;
}

VideoRequest::Kind kindOf(const std::string& source) {
  using Kind = VideoRequest::Kind;
  std::error_code error;
  if (source.empty()) refuse(source, "expected a camera, a video file or a series of images");
  if (source.find_first_not_of("0123456789") == std::string::npos) return Kind::camera;
  if (source.find("://") != std::string::npos) return Kind::stream;
  if (source.compare(0, 5, "/dev/") == 0 && !fs::exists(source, error)) {
    refuse(source, "there is no such camera");
  }
  if (fs::is_character_file(source, error)) return Kind::camera;
  if (isBag(source)) {
    refuse(source, "is a bag, not a camera or a video; depthservo replay observes recordings");
  }
  if (fs::is_directory(source, error)) {
    refuse(source, "is a folder; give its images as FOLDER/%06d.png, or use replay");
  }
  if (!fs::is_regular_file(source, error)) refuse(source, "there is no such file");
  return Kind::file;
}

std::unique_ptr<VideoReader> open(const std::string& source, VideoRequest::Kind kind,
                                  const VideoOptions& options) {
  static detail::OpenVideo* const openVideo = detail::loadVideoModule(detail::videoModulePlaces());
  std::unique_ptr<VideoReader> reader(
      openVideo({source.c_str(), kind, options.width, options.height, options.fps}));
  if (!reader) {
    refuse(source, kind == VideoRequest::Kind::camera ? "there is no camera that can be opened"
                                                      : "is no video that OpenCV can read");
  }
  return reader;
}

class Video : public ImageSource {
 public:
  Video(const std::string& source, const VideoOptions& options)
      : kind_(kindOf(source)), options_(options), reader_(open(source, kind_, options)) {
    isGiven_ = options.fps > 0 || !options.times.empty();
    fps_ = options.fps > 0 ? options.fps : reader_->fps();
    if (!isLive() && !isGiven_ && fps_ == 0) {
      refuse(source, "says nothing of its frame rate; give --fps or --times");
    }
    if (reader_->isTurned()) {
      refuse(
          source,
          "its images are to be shown turned, and nothing says whether the camera was calibrated "
          "with turned images; turn the pixels (ffmpeg -i FILE -c:v ffv1 turned.mkv)");
    }
  }

  bool isLive() const override { return kind_ != VideoRequest::Kind::file; }
  double fps() const override { return fps_; }
  std::string reason() const override { return reason_; }

  ImageStatus next(TimedImage& image) override {
    VideoReader::Image read;
    if (!isLive() && !options_.times.empty() && taken_ == options_.times.size()) {
      reason_ = fmt::format("no more times: {} are given", taken_);
      return ImageStatus::ended;
    }
    if (!reader_->read(read)) {
      reason_ = isLive() ? "the camera gives no more images" : endOfFile();
      return ImageStatus::ended;
    }
    image.time_s = time_s(read.time_s);
    ++taken_;
    last_s_ = image.time_s - options_.start_s;
    if (!read.gray) {
      reason_ = fmt::format("image {} has not 8 bits per colour", taken_);
      return ImageStatus::skipped;
    }
    image.image.resize(static_cast<unsigned>(read.height), static_cast<unsigned>(read.width));
    std::copy_n(read.gray, image.image.getSize(), image.image.bitmap);
    return ImageStatus::image;
  }

 private:
  double time_s(double container_s) {
    const auto k = static_cast<double>(taken_);
    if (isLive()) {
      return detail::systemTime_s() - options_.latency_s;
    }
    if (!options_.times.empty()) return options_.times[taken_];
    // A container rounds its times, to a millisecond at the worst.
    constexpr double kRounding_s = 1.5e-3;
    const double constant_s = k / fps_;
    varies_ = varies_ || (!isGiven_ && std::abs(container_s - constant_s) > kRounding_s);
    return fileTime(options_.start_s + (varies_ ? container_s : constant_s));
  }

  std::string endOfFile() const {
    std::string text = fmt::format("end of the file: {} images", taken_);
    if (varies_) text += fmt::format(" at times of the container up to {:.3f} s", last_s_);
    if (!options_.times.empty() && options_.times.size() != taken_) {
      text += fmt::format(", but {} times given", options_.times.size());
    }
    constexpr double kWhole = 0.9;
    if (!isGiven_ && last_s_ + 1 / fps_ < kWhole * reader_->duration_s()) {
      text += fmt::format(", but it says that it lasts {:.3f} s: is it cut off?",
                          reader_->duration_s());
    }
    return text;
  }

  VideoRequest::Kind kind_;
  VideoOptions options_;
  std::unique_ptr<VideoReader> reader_;
  bool isGiven_ = false;  // rate or times, by the user
  bool varies_ = false;   // the frame rate; for good
  double fps_ = 0, last_s_ = 0;
  std::size_t taken_ = 0;
  std::string reason_;
};

}  // namespace

std::optional<GrayImage> imageIn(const std::string& file) {
  std::error_code error;
  const std::string extension = fs::path(file).extension().string();
  const bool isImage = extension == ".png" || extension == ".pgm" || extension == ".ppm" ||
                       extension == ".jpg" || extension == ".jpeg";
  if (!isImage || !fs::is_regular_file(file, error) || isSeries(file)) return std::nullopt;
  return detail::ImageFile(file).gray();
}

VideoSource::VideoSource(const std::string& source, const VideoOptions& options) {
  std::error_code error;
  if (fs::is_fifo(source, error)) {
    source_ = std::make_unique<detail::ImagePipe>(source, options);
  } else if (isSeries(source)) {
    source_ = std::make_unique<detail::ImageSeries>(source, options);
  } else {
    source_ = std::make_unique<Video>(source, options);
  }
}

VideoSource::~VideoSource() = default;

ImageStatus VideoSource::next(TimedImage& image) { return source_->next(image); }
std::string VideoSource::reason() const { return source_->reason(); }
bool VideoSource::isLive() const { return source_->isLive(); }
double VideoSource::fps() const { return source_->fps(); }
std::size_t VideoSource::leftOut() const { return source_->leftOut(); }

}  // namespace depthservo
