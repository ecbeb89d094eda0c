#include "sequence/ImageSeries.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "depthservo/sequence/SequenceWriter.h"
#include "depthservo/text/InputError.h"
#include "sequence/ImageFile.h"
#include "sequence/ImageFolder.h"

namespace depthservo::detail {
namespace {

namespace fs = std::filesystem;

/// The name with the number `example` has, for another number.
std::string withNumber(const std::string& example, const NumberedName& name, long number) {
  const std::size_t digits = example.size() - name.before.size() - name.after.size();
  return fmt::format("{}{:0{}}{}", name.before, number, digits, name.after);
}

}  // namespace

ImageSeries::ImageSeries(const std::string& pattern, const VideoOptions& options)
    : options_(options), name_(pattern) {
  const fs::path path(pattern);
  const auto name = NumberedName::parse(path.filename().string());
  if (!name) throw InputError({pattern, 0, ""}, "expected a file name with one %d or %06d");
  const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
  const auto byNumber = numberedFiles(folder.string(), *name);
  if (byNumber.empty()) throw InputError({pattern, 0, ""}, "there is no first image of this name");
  const auto& [first, example] = *byNumber.begin();
  const std::size_t span = static_cast<std::size_t>(byNumber.rbegin()->first - first) + 1;
  constexpr std::size_t kMostMissing = 1000;
  if (span > byNumber.size() + kMostMissing) {
    throw InputError({pattern, 0, ""},
                     fmt::format("{} of the {} images from {} to {} are missing",
                                 span - byNumber.size(), span, example, byNumber.rbegin()->second));
  }
  std::vector<std::string> there;
  for (std::size_t i = 0; i < span; ++i) {
    const auto found = byNumber.find(first + static_cast<long>(i));
    names_.push_back(found == byNumber.end()
                         ? withNumber(example, *name, first + static_cast<long>(i))
                         : found->second);
    files_.push_back(found == byNumber.end() ? "" : (folder / found->second).string());
    if (!files_.back().empty()) there.push_back(files_.back());
  }
  if (options.times.empty() && !(options.fps > 0)) {
    throw InputError({pattern, 0, ""}, "says nothing of its frame rate; give --fps or --times");
  }
  if (!options.times.empty() && options.times.size() != span && first > 1) {
    throw InputError({pattern, 0, ""},
                     fmt::format("{} times are given for the {} images from {} on: is the first "
                                 "image missing?",
                                 options.times.size(), span, example));
  }
  bits_ = usedBits(there);
}

ImageStatus ImageSeries::skip(const std::string& reason) {
  reason_ = reason;
  skipped_.push_back(reason);
  return ImageStatus::skipped;
}

ImageStatus ImageSeries::next(TimedImage& image) {
  const std::size_t k = place_;
  const bool hasTimes = !options_.times.empty();
  if (k == files_.size() || (hasTimes && k == options_.times.size())) {
    end();
    return ImageStatus::ended;
  }
  ++place_;
  if (files_[k].empty()) return skip(names_[k] + " is missing");
  try {
    const ImageFile file(files_[k]);
    if (file.isWhiteUnknown() && bits_ == 0) {
      return skip(names_[k] + " has 16 bits, the first image has 8");
    }
    image.image = file.gray(bits_);
  } catch (const InputError& error) {
    return skip(names_[k] + " " + error.message());
  } catch (const std::exception& error) {
    return skip(fmt::format("{} cannot be read: {}", names_[k], error.what()));
  }
  image.time_s = hasTimes ? options_.times[k]
                          : fileTime(options_.start_s + static_cast<double>(k) / options_.fps);
  ++read_;
  return ImageStatus::image;
}

void ImageSeries::end() {
  constexpr std::size_t kMostNamed = 3;
  const std::size_t files = files_.size(), times = options_.times.size();
  const std::size_t expected = std::max(files, times);
  reason_ = read_ == expected ? fmt::format("all {} images read", read_)
                              : fmt::format("{} of {} images read", read_, expected);
  if (times > 0 && times != files) {
    reason_ += fmt::format(": {} times given for {} images", times, files);
  }
  for (std::size_t i = 0; i < std::min(kMostNamed, skipped_.size()); ++i) {
    reason_ += (i == 0 ? "; left out: " : "; ") + skipped_[i];
  }
  if (skipped_.size() > kMostNamed) {
    reason_ += fmt::format("; and {} more", skipped_.size() - kMostNamed);
  }
}

}  // namespace depthservo::detail
