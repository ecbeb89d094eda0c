#pragma once

#include <string>
#include <vector>

#include "depthservo/sequence/VideoSource.h"

namespace depthservo::detail {

/// A series of image files, such as folder/%06d.png. What is missing or cannot be read is skipped;
/// the end says what was skipped.
class ImageSeries : public ImageSource {
 public:
  /// Throws InputError: no such file, no times.
  ImageSeries(const std::string& pattern, const VideoOptions& options);

  ImageStatus next(TimedImage& image) override;
  std::string reason() const override { return reason_; }
  bool isLive() const override { return false; }
  double fps() const override { return options_.fps; }

 private:
  ImageStatus skip(const std::string& reason);
  void end();

  VideoOptions options_;
  std::string name_;                // of the series, for messages
  std::vector<std::string> files_;  // one for each number; empty: missing
  std::vector<std::string> names_;  // of the files, also of missing ones
  std::size_t place_ = 0, read_ = 0;
  std::vector<std::string> skipped_;  // why
  int bits_ = 0;                      // used by images of 16
  std::string reason_;
};

}  // namespace depthservo::detail
