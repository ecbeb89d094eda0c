#pragma once

#include <string>
#include <string_view>

#include "depthservo/api.h"
#include "depthservo/sequence/VideoSource.h"

namespace depthservo::detail {

/// Gray images from a named pipe: binary PGM (P5, 8 bits), one after the other, each with the
/// comment `# timestamp SECONDS` in its header; without it an image has the system's time of its
/// arrival, less the latency.
///
/// The images are live: of several that wait, the newest is given. Bytes that belong to no image
/// are left out. It ends when its writer goes away, or is silent for too long.
class DEPTHSERVO_INNER ImagePipe : public ImageSource {
 public:
  /// \throw InputError it cannot be read
  ImagePipe(const std::string& path, const VideoOptions& options);
  ~ImagePipe() override;
  ImagePipe(const ImagePipe&) = delete;
  ImagePipe& operator=(const ImagePipe&) = delete;

  ImageStatus next(TimedImage& image) override;
  std::string reason() const override { return reason_; }
  bool isLive() const override { return true; }
  double fps() const override { return options_.fps; }
  std::size_t leftOut() const override { return leftOut_; }

 private:
  struct Frame {
    std::size_t begin = 0, pixels = 0, end = 0;  // in bytes_
    unsigned width = 0, height = 0;
    double time_s = 0;  // NaN: not stamped
  };
  enum class Parsed { frame, unfinished, rubbish };
  Parsed parse(std::size_t at, Frame& frame) const;
  bool takeNewest(TimedImage& image);
  bool readMore();

  VideoOptions options_;
  std::string name_, reason_, bytes_;
  int file_ = -1;
  bool hasEnded_ = false, isFirst_ = true;
  std::size_t leftOut_ = 0;
};

/// An image as it stands in such a pipe.
DEPTHSERVO_INNER void appendTo(std::string& bytes, double time_s,
                               const DEPTHSERVO_VISP vpImage<unsigned char>& image);

}  // namespace depthservo::detail
