#include "sequence/vispCamera.h"

#include <fmt/format.h>

#include <optional>
#include <vector>

#include "text/TextFile.h"

namespace depthservo::detail {
namespace {

constexpr std::size_t kLargestXml_bytes = std::size_t{1} << 20;
constexpr const char *kPlain = "perspectiveProjWithoutDistortion",
                     *kDistorted = "perspectiveProjWithDistortion";

std::string withoutComments(std::string text) {
  for (std::size_t at = text.find("<!--"); at != std::string::npos; at = text.find("<!--", at)) {
    const std::size_t end = text.find("-->", at);
    text.erase(at, end == std::string::npos ? std::string::npos : end + 3 - at);
  }
  return text;
}

/// What stands in all elements of a name; these files have no attributes.
std::vector<std::string> elements(const std::string& text, const std::string& name) {
  const std::string open = "<" + name + ">", close = "</" + name + ">";
  std::vector<std::string> found;
  for (std::size_t at = text.find(open); at != std::string::npos; at = text.find(open, at)) {
    at += open.size();
    const std::size_t end = text.find(close, at);
    if (end == std::string::npos) break;
    found.push_back(text.substr(at, end - at));
    at = end;
  }
  return found;
}

std::string trimmedWord(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

/// A camera and one of its models.
class Elements {
 public:
  Elements(std::string file, std::string text) : file_(std::move(file)), text_(std::move(text)) {}

  double number(const char* name, const Range& range, const char* unit) const {
    const auto found = elements(text_, name);
    if (found.size() != 1) refuse(name, fmt::format("expected once, got {} times", found.size()));
    const std::string word = trimmedWord(found[0]);
    const auto number = toNumber(word);
    if (!number || !range.contains(*number)) refuse(name, expectedNumber(range, unit, word));
    return *number;
  }

  [[noreturn]] void refuse(const std::string& key, const std::string& message) const {
    throw InputError({file_, 0, key}, message);
  }

 private:
  std::string file_, text_;
};

}  // namespace

bool isXml(const std::string& path) {
  const std::string bytes = readFile(path, kLargestXml_bytes);
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  return first != std::string::npos && bytes[first] == '<';
}

PinholeCamera readVispCamera(const std::string& path) {
  const std::string text =
      withoutComments(readTextFile(path, {kLargestXml_bytes, kLargestXml_bytes}));
  const auto cameras = elements(text, "camera");
  const Elements size(path, cameras.empty() ? "" : cameras[0]);
  if (cameras.size() != 1) {
    size.refuse("camera",
                fmt::format("expected one camera as ViSP writes it, got {}", cameras.size()));
  }
  std::optional<Elements> plain, distorted;
  for (const std::string& model : elements(cameras[0], "model")) {
    const auto types = elements(model, "type");
    const std::string type = types.size() == 1 ? trimmedWord(types[0]) : "";
    if (type == kPlain) plain.emplace(path, model);
    if (type == kDistorted) distorted.emplace(path, model);
  }
  if (!plain && !distorted)
    size.refuse("model", fmt::format("expected {} or {}", kPlain, kDistorted));

  constexpr Range kFocal = Range::above(0, 1e5), kCentre{-1e5, 1e5}, kSide{1, 16384};
  constexpr Range kCoefficient{-10, 10};
  const Elements& model = distorted ? *distorted : *plain;
  PinholeCamera camera{static_cast<int>(size.number("image_width", kSide, "px")),
                       static_cast<int>(size.number("image_height", kSide, "px")),
                       model.number("px", kFocal, "px"),
                       model.number("py", kFocal, "px"),
                       model.number("u0", kCentre, "px"),
                       model.number("v0", kCentre, "px")};
  if (!distorted) return camera;
  camera.distortion = {model.number("kud", kCoefficient, ""), 0, 0, 0};
  for (const double u : {0., camera.width - 1.}) {
    for (const double v : {0., camera.height - 1.}) {
      if (!camera.canNormalise(u, v)) {
        model.refuse("kud", "the distortion folds back within the image");
      }
    }
  }
  return camera;
}

}  // namespace depthservo::detail
