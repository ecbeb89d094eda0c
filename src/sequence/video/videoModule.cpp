#include "sequence/videoModule.h"

#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <string>

#include "motion/median.h"

namespace depthservo::detail {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

bool open(cv::VideoCapture& video, const VideoRequest& request) {
  const std::string source = request.source;
  const auto tried = [&](int api) {
    try {
      return api == cv::CAP_V4L2 && source.size() < 4 && source.find('/') == std::string::npos
                 ? video.open(std::stoi(source), api)
                 : video.open(source, api);
    } catch (const cv::Exception&) {
      return false;
    }
  };
  if (request.kind == VideoRequest::Kind::camera) return tried(cv::CAP_V4L2);
  return tried(cv::CAP_FFMPEG) || tried(cv::CAP_ANY);
}

/// What a property is; 0 when it is not known.
double property(const cv::VideoCapture& video, int which) {
  const double value = video.get(which);
  return std::isfinite(value) && value > 0 ? value : 0;
}

class OpenCvReader : public VideoReader {
 public:
  explicit OpenCvReader(const VideoRequest& request) {
    if (!open(video_, request)) return;
    fps_ = property(video_, cv::CAP_PROP_FPS);
    if (request.kind == VideoRequest::Kind::camera) {
      if (request.width > 0) video_.set(cv::CAP_PROP_FRAME_WIDTH, request.width);
      if (request.height > 0) video_.set(cv::CAP_PROP_FRAME_HEIGHT, request.height);
      if (request.fps > 0) video_.set(cv::CAP_PROP_FPS, request.fps);
      video_.set(cv::CAP_PROP_BUFFERSIZE, 1);
      fps_ = property(video_, cv::CAP_PROP_FPS);
      return;
    }
    if (request.kind != VideoRequest::Kind::file) return;
    if (fps_ > 0) duration_s_ = property(video_, cv::CAP_PROP_FRAME_COUNT) / fps_;
    isTurned_ = std::fmod(video_.get(cv::CAP_PROP_ORIENTATION_META), 360) != 0;
    findRate(request);
  }

  bool isOpen() const { return video_.isOpened(); }

  bool read(Image& image) override {
    try {
      if (!video_.read(frame_) || frame_.empty()) return false;
      ++taken_;
      image = {nullptr, frame_.cols, frame_.rows, containerTime_s()};
      if (frame_.depth() != CV_8U) return true;
      if (frame_.channels() == 1) {
        frame_.copyTo(gray_);
      } else {
        cv::cvtColor(frame_, gray_,
                     frame_.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
      }
      image.gray = gray_.ptr();
      return true;
    } catch (const cv::Exception&) {
      return false;
    }
  }

  double fps() const override { return fps_; }
  double duration_s() const override { return duration_s_; }
  bool isTurned() const override { return isTurned_; }

 private:
  /// The time of the image just read or grabbed.
  double containerTime_s() {
    const double time_s = video_.get(cv::CAP_PROP_POS_MSEC) / 1000;
    if (taken_ <= 1) first_s_ = time_s;
    return hasTimes_ ? time_s - first_s_ : kUnknown;
  }

  /// The rate in the header may be the mean of one that varies, or just the clock's resolution:
  /// looks at the first images. Then opens the file again.
  void findRate(const VideoRequest& request) {
    constexpr int kLooks = 16;
    std::vector<double> periods;
    try {
      double before_s = kUnknown;
      for (int i = 0; i < kLooks && video_.grab(); ++i) {
        const double time_s = video_.get(cv::CAP_PROP_POS_MSEC) / 1000;
        if (time_s > before_s) periods.push_back(time_s - before_s);
        before_s = time_s;
      }
      hasTimes_ = !periods.empty();
    } catch (const cv::Exception&) {
      hasTimes_ = false;
    }
    if (hasTimes_) {
      const double period_s = detail::medianOf(periods);
      constexpr double kAlike = 0.1;  // containers round times to a millisecond
      if (std::abs(period_s * fps_ - 1) > kAlike) fps_ = 1 / period_s;
    }
    video_.release();
    open(video_, request);
  }

  cv::VideoCapture video_;
  cv::Mat frame_, gray_;
  double fps_ = 0, duration_s_ = 0, first_s_ = 0;
  bool isTurned_ = false, hasTimes_ = false;
  std::size_t taken_ = 0;
};

}  // namespace
}  // namespace depthservo::detail

extern "C" __attribute__((visibility("default"))) depthservo::detail::VideoReader*
depthservoOpenVideo(const depthservo::detail::VideoRequest& request) {
  auto reader = std::make_unique<depthservo::detail::OpenCvReader>(request);
  return reader->isOpen() ? reader.release() : nullptr;
}
