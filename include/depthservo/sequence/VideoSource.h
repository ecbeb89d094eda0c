#pragma once

#include <visp3/core/vpImage.h>

#include <memory>
#include <string>
#include <vector>

#include "depthservo/visp/visp.h"

namespace depthservo {

/// A gray image and when it was taken.
struct TimedImage {
  double time_s = 0;
  DEPTHSERVO_VISP vpImage<unsigned char> image;
};

/// Images, one after the other.
class ImageSource {
 public:
  virtual ~ImageSource() = default;

  /// The next image; false when there are no more. Never throws.
  virtual bool next(TimedImage& image) = 0;

  /// Whether images come in real time and are lost when nobody takes them.
  virtual bool isLive() const = 0;

  /// Why there are no more, after `next` said so.
  virtual std::string whyEnded() const = 0;
};

struct VideoOptions {
  int width = 0, height = 0;  ///< asked of a camera [px]; 0: as it comes
  double fps = 0;             ///< images of a file per second [Hz]; 0: as the file says
  double start_s = 0;         ///< time of the first image of a file
  std::vector<double>
      times;             ///< of the images of a file [s], instead of fps and start_s; may be empty
  double latency_s = 0;  ///< age of a camera's image when it arrives
};

/// A camera, a stream, a video file or a series of image files, through OpenCV.
///
/// Images of a camera carry the system's clock (seconds since 1970) at their arrival, less the
/// latency; those of a file the time `start_s + k / fps`, to 9 decimals.
class VideoSource : public ImageSource {
 public:
  /// \param source number of a camera, its device (/dev/video0), the address of a stream
  /// (rtsp://...), a video file, or a series of image files (folder/%06d.png)
  /// \throw InputError it cannot be opened, or a file says no frame rate and none is given
  VideoSource(const std::string& source, const VideoOptions& options);
  ~VideoSource() override;

  bool next(TimedImage& image) override;
  bool isLive() const override;
  std::string whyEnded() const override;

  double fps() const;  ///< of a file, or as a camera says; 0: not known [Hz]

 private:
  struct Capture;
  std::unique_ptr<Capture> capture_;
};

}  // namespace depthservo
