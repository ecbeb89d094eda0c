#include "sequence/vispCamera.h"

#include <fmt/format.h>
#include <visp3/core/vpXmlParserCamera.h>

#include <iostream>
#include <sstream>

#include "depthservo/visp/visp.h"
#include "text/TextFile.h"

namespace depthservo::detail {
namespace {

constexpr std::size_t kLargest_bytes = std::size_t{1} << 20;

/// ViSP tells on stderr what it thinks of a file; what matters of it is told by us.
class SilentErrors {
 public:
  SilentErrors() : before_(std::cerr.rdbuf(swallowed_.rdbuf())) {}
  ~SilentErrors() { std::cerr.rdbuf(before_); }
  SilentErrors(const SilentErrors&) = delete;
  SilentErrors& operator=(const SilentErrors&) = delete;

 private:
  std::ostringstream swallowed_;
  std::streambuf* before_;
};

std::size_t countOf(const std::string& text, const std::string& word) {
  std::size_t count = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    ++count;
  }
  return count;
}

}  // namespace

bool isXml(const std::string& path) {
  const std::string bytes = readFile(path, kLargest_bytes);
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  return first != std::string::npos && bytes[first] == '<';
}

PinholeCamera readVispCamera(const std::string& path) {
  using Parser = DEPTHSERVO_VISP vpXmlParserCamera;
  using Parameters = DEPTHSERVO_VISP vpCameraParameters;
  const auto refuse = [&](const std::string& key, const std::string& message) {
    throw InputError({path, 0, key}, message);
  };
  const std::size_t cameras = countOf(readFile(path, kLargest_bytes), "<camera>");
  if (cameras != 1) {
    refuse("camera", fmt::format("expected one camera as ViSP writes it, got {}", cameras));
  }
  Parser parser;
  Parameters read;
  bool isRead = false;
  {
    const SilentErrors silent;
    for (const auto model : {Parameters::perspectiveProjWithDistortion,
                             Parameters::perspectiveProjWithoutDistortion}) {
      isRead = isRead || parser.parse(read, path, "", model) == Parser::SEQUENCE_OK;
    }
  }
  if (!isRead) {
    refuse("model", "expected perspectiveProjWithoutDistortion or perspectiveProjWithDistortion");
  }
  PinholeCamera camera{static_cast<int>(parser.getWidth()),
                       static_cast<int>(parser.getHeight()),
                       read.get_px(),
                       read.get_py(),
                       read.get_u0(),
                       read.get_v0()};
  if (camera.width < 1 || camera.height < 1) {
    refuse("image_width", "missing: the size of the image");
  }
  constexpr Range kFocal = Range::above(0, 1e5), kCentre{-1e5, 1e5}, kDistortion{-10, 10};
  if (!kFocal.contains(camera.fx) || !kFocal.contains(camera.fy) || !kCentre.contains(camera.cx) ||
      !kCentre.contains(camera.cy)) {
    refuse("px", fmt::format("expected px and py in {}, u0 and v0 in {}", kFocal.text("px"),
                             kCentre.text("px")));
  }
  if (read.get_projModel() != Parameters::perspectiveProjWithDistortion) return camera;
  if (!kDistortion.contains(read.get_kud())) refuse("kud", "expected " + kDistortion.text(""));
  camera.distortion = {read.get_kud(), 0, 0, 0};
  for (const double u : {0., camera.width - 1.}) {
    for (const double v : {0., camera.height - 1.}) {
      if (!camera.canNormalise(u, v)) refuse("kud", "the distortion folds back within the image");
    }
  }
  return camera;
}

}  // namespace depthservo::detail
