#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/api.h"
#include "depthservo/visp/GrayImage.h"

namespace depthservo {

/// A gray image and when it was taken.
struct TimedImage {
  double time_s = 0;
  GrayImage image;
};

/// The gray image of a PGM, PPM, PNG or JPEG file; none: the file is no image. \throw InputError it
/// is a damaged one
DEPTHSERVO_API std::optional<GrayImage> imageIn(const std::string& file);

/// What came of asking for the next image.
enum class ImageStatus {
  image,
  skipped,  ///< the image that should be here cannot be used; the next one may
  ended     ///< there are no more
};

/// Images, one after the other.
class DEPTHSERVO_API ImageSource {
 public:
  virtual ~ImageSource() = default;

  /// The next image; `image` is undefined unless the status is `image`. Never throws.
  virtual ImageStatus next(TimedImage& image) = 0;

  /// Why the last image was skipped, or why there are no more and what is missing: one line that
  /// names the file.
  virtual std::string reason() const = 0;

  /// Whether images come in real time and are lost when nobody takes them.
  virtual bool isLive() const = 0;

  virtual double fps() const { return 0; }  ///< images per second [Hz]; 0: not known

  /// Images that came and were left out since a newer one was there.
  virtual std::size_t leftOut() const { return 0; }
};

struct VideoOptions {
  int width = 0, height = 0;  ///< asked of a camera [px]; 0: as it comes
  double fps = 0;             ///< images of a file per second [Hz]; 0: as the file says
  double start_s = 0;         ///< time of the first image of a file
  std::vector<double>
      times;             ///< of the images of a file [s], instead of fps and start_s; may be empty
  double latency_s = 0;  ///< age of a camera's image when it arrives

  // Of a pipe.
  double first_s = 30, silence_s = 2;       ///< waits so long for its first image, for others
  const std::atomic<bool>* stop = nullptr;  ///< once it is true, waiting ends; may be null
};

/// A camera, a stream, a video file (through OpenCV, which is loaded by the first of them), a
/// series of image files, or a named pipe of PGM images.
///
/// Those of a pipe carry the time of their comment `# timestamp SECONDS`; without one they are
/// those of a camera. Of several that wait the newest is given.
///
/// Images of a camera carry the system's clock (seconds since 1970) at their arrival, less the
/// latency. Those of a file have the given times, or `start_s + k / fps` for a given rate, to 9
/// decimals; else those of a video file have the times of their container from `start_s` on, so
/// that the rate may vary. An image of a series that is missing or unreadable is skipped; the
/// others keep their times.
class DEPTHSERVO_API VideoSource : public ImageSource {
 public:
  /// \param source number of a camera, its device (/dev/video0), the address of a stream
  /// (rtsp://...), a video file, a series of image files (folder/%06d.png), or a named pipe
  /// \throw InputError it cannot be opened, says no times and none are given, or is to be shown
  /// turned (metadata of a video)
  VideoSource(const std::string& source, const VideoOptions& options);
  ~VideoSource() override;

  ImageStatus next(TimedImage& image) override;
  std::string reason() const override;
  bool isLive() const override;
  double fps() const override;
  std::size_t leftOut() const override;

 private:
  std::unique_ptr<ImageSource> source_;
};

}  // namespace depthservo
