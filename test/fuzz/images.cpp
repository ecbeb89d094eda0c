// Image files (PGM, PPM, PNG, JPEG), and the pipe of PGM images of a camera.
#include <sys/stat.h>

#include <filesystem>

#include "Target.h"
#include "depthservo/text/InputError.h"
#include "sequence/ImageFile.h"
#include "sequence/ImagePipe.h"

namespace depthservo::fuzz {
namespace {

const Target kImage("image", [](const std::string& bytes) {
  const detail::ImageFile file("image", bytes);
  const auto gray = file.gray(12);
  require(static_cast<int>(gray.getWidth()) == file.size().width &&
              static_cast<int>(gray.getHeight()) == file.size().height,
          "an image of the size that its header says");
  if (file.isDepth()) file.levels16();
});

/// A file has all that a pipe could have had at once, and ends where its writer goes away.
const Target kPipe("image_pipe", [](const std::string& bytes) {
  VideoOptions options;
  options.first_s = options.silence_s = 0.01;
  detail::ImagePipe pipe(written("pipe", bytes), options);
  TimedImage image;
  while (pipe.next(image) != ImageStatus::ended) {
  }
  require(!pipe.reason().empty(), "an end with its reason");
});

}  // namespace
}  // namespace depthservo::fuzz
