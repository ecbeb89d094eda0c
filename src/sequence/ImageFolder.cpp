#include "sequence/ImageFolder.h"

#include <fmt/format.h>
#include <visp3/core/vpIoTools.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "sequence/ImageFile.h"

namespace depthservo::detail {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> filesIn(const std::string& folder) {
  std::error_code error;
  std::vector<std::string> files;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    files.push_back(it->path().filename().string());
  }
  if (error) throw InputError({folder, 0, ""}, "cannot be read: " + error.message());
  std::sort(files.begin(), files.end());
  return files;
}

/// "image.0001.pgm": the last digits before the extension of an image file.
std::optional<NumberedName> numberedImage(const std::string& file) {
  std::string extension = fs::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  static const std::set<std::string> images = {".pgm", ".ppm", ".png", ".jpg", ".jpeg"};
  if (images.count(extension) == 0) return std::nullopt;
  const std::size_t stem = file.size() - extension.size();
  const std::size_t last = file.find_last_of("0123456789", stem - 1);
  if (stem == 0 || last == std::string::npos) return std::nullopt;
  const std::size_t before = file.find_last_not_of("0123456789", last);
  const std::size_t first = before == std::string::npos ? 0 : before + 1;
  return NumberedName{file.substr(0, first), file.substr(last + 1)};
}

}  // namespace

std::optional<NumberedName> NumberedName::parse(const std::string& pattern) {
  const std::size_t percent = pattern.find('%');
  if (percent == std::string::npos || pattern.find('/') != std::string::npos) return std::nullopt;
  std::size_t end = percent + 1;
  while (end < pattern.size() && pattern[end] >= '0' && pattern[end] <= '9') ++end;
  if (end >= pattern.size() || pattern[end] != 'd' || end > percent + 3) return std::nullopt;
  if (pattern.find('%', end) != std::string::npos) return std::nullopt;
  return NumberedName{pattern.substr(0, percent), pattern.substr(end + 1)};
}

std::optional<long> NumberedName::number(const std::string& file) const {
  if (file.size() <= before.size() + after.size() || file.compare(0, before.size(), before) != 0 ||
      file.compare(file.size() - after.size(), after.size(), after) != 0) {
    return std::nullopt;
  }
  const std::string digits = file.substr(before.size(), file.size() - before.size() - after.size());
  if (digits.size() > 9 || digits.find_first_not_of("0123456789") != std::string::npos) {
    return std::nullopt;
  }
  return std::stol(digits);
}

std::map<long, std::string> numberedFiles(const std::string& folder, const NumberedName& name) {
  std::map<long, std::string> byNumber;
  for (const std::string& file : filesIn(folder)) {
    const auto number = name.number(file);
    if (!number) continue;
    if (!byNumber.emplace(*number, file).second) {
      throw InputError({folder, 0, ""},
                       fmt::format("{} and {} have the same number", byNumber[*number], file));
    }
  }
  return byNumber;
}

std::vector<ListedImage> numberedSeries(const std::string& folder, const NumberedName& name,
                                        double rate, const InputError& none) {
  const std::map<long, std::string> byNumber = numberedFiles(folder, name);
  if (byNumber.empty()) throw none;
  std::vector<ListedImage> images;
  const long first = byNumber.begin()->first;
  for (const auto& [number, file] : byNumber) {
    const long expected = first + static_cast<long>(images.size());
    if (number != expected) {
      throw InputError({folder, 0, ""},
                       fmt::format("image number {} is missing ({} comes after number {})",
                                   expected, file, expected - 1));
    }
    images.push_back(
        {static_cast<double>(images.size()) / rate, (fs::path(folder) / file).string()});
  }
  return images;
}

std::vector<ListedImage> plainImageFolder(const std::string& folder, double fps) {
  std::optional<NumberedName> series;
  for (const std::string& file : filesIn(folder)) {
    const auto name = numberedImage(file);
    if (!name) continue;
    if (series && (name->before != series->before || name->after != series->after)) {
      throw InputError({folder, 0, ""},
                       fmt::format("has two series of images, {}*{} and {}*{}; expected one",
                                   series->before, series->after, name->before, name->after));
    }
    series = name;
  }
  const InputError none({folder, 0, ""},
                        "is not a sequence: it has no rgb.txt, associations.txt, mav0/cam0 or "
                        "tracks.csv, no images in sequence.yaml and no numbered images "
                        "(image.0001.pgm)");
  if (!series) throw none;
  if (fps <= 0) {
    throw InputError({folder, 0, "--fps"}, "missing; a folder of numbered images has no times");
  }
  return numberedSeries(folder, *series, fps, none);
}

std::string findImageFolder(const std::string& folder, const std::string& sequenceFolder) {
  static const std::string kPrefix = "ViSP-images/";
  const std::string stripped =
      folder.compare(0, kPrefix.size(), kPrefix) == 0 ? folder.substr(kPrefix.size()) : folder;
  std::vector<fs::path> candidates = {fs::path(sequenceFolder) / folder};
  if (const char* input = std::getenv("VISP_INPUT_IMAGE_PATH")) {
    for (const char* below : {"", "ViSP-images", "visp-images"}) {
      candidates.push_back(fs::path(input) / below / stripped);
    }
  }
  const std::string visp = DEPTHSERVO_VISP vpIoTools::getViSPImagesDataPath();
  if (!visp.empty()) candidates.push_back(fs::path(visp) / stripped);
  for (const fs::path& candidate : candidates) {
    std::error_code error;
    if (fs::is_directory(candidate, error)) return candidate.string();
  }
  return "";
}

int usedBits(const std::vector<std::string>& images) {
  return usedBits(images.size(), [&](std::size_t i) { return ImageFile(images.at(i)); });
}

int usedBits(std::size_t images, const std::function<ImageFile(std::size_t)>& open) {
  constexpr std::size_t kLooks = 4;
  int bits = 0;
  for (std::size_t i = 0; i <= kLooks; ++i) {
    try {
      const ImageFile file = open(i * (images - 1) / kLooks);
      if (!file.isWhiteUnknown()) {
        if (i == 0) return 0;
        continue;
      }
      const auto levels = file.levels16();
      const int most = *std::max_element(levels.begin(), levels.end());
      for (const int enough : {8, 10, 12, 14, 16}) {
        if (most >> enough) continue;
        bits = std::max(bits, enough);
        break;
      }
    } catch (const InputError&) {
      if (i == 0) return 0;
    }
  }
  return bits;
}

}  // namespace depthservo::detail
