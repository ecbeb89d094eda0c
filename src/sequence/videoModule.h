#pragma once

#include <filesystem>
#include <vector>

#include "depthservo/api.h"

namespace depthservo::detail {

/// What to open.
struct VideoRequest {
  const char* source;
  enum class Kind { camera, stream, file } kind;
  int width, height;  ///< asked of a camera [px]; 0: as it comes
  double fps;         ///< asked of a camera [Hz]; 0: as it comes
};

/// Images of a camera, a stream or a video file, made by the module libdepthservo_video.so: all of
/// OpenCV's video and cameras, 200 libraries that a program loads with its first video.
class VideoReader {
 public:
  virtual ~VideoReader() = default;

  struct Image {
    const unsigned char* gray;  ///< row by row, until the next call; null: cannot be used
    int width, height;          ///< [px]
    double time_s;              ///< of the container, from the first image on; NaN: it has none
  };
  /// False when there are no more. Never throws.
  virtual bool read(Image& image) = 0;

  virtual double fps() const = 0;         ///< as it says [Hz]; 0: it does not
  virtual double duration_s() const = 0;  ///< of a file, as it says; 0: it does not
  virtual bool isTurned() const = 0;      ///< whether a file asks for its images to be turned
};

/// The one function of the module; null when nothing can be opened.
using OpenVideo = VideoReader*(const VideoRequest&);
constexpr const char* kOpenVideo = "depthservoOpenVideo";

/// Loads the module from the first of these places where it is. Throws InputError: it is not
/// there, or cannot be loaded.
DEPTHSERVO_INNER OpenVideo* loadVideoModule(const std::vector<std::filesystem::path>& places);

/// Where the module may be: beside this library, or where it is installed.
std::vector<std::filesystem::path> videoModulePlaces();

}  // namespace depthservo::detail
