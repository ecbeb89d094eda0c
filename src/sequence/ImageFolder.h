#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "depthservo/sequence/Sequence.h"
#include "sequence/ImageFile.h"

namespace depthservo::detail {

/// Numbered image files "<before><digits><after>".
struct NumberedName {
  std::string before, after;

  /// From a pattern such as image.%04d.pgm; nothing unless it has exactly one %d or %0Nd.
  static std::optional<NumberedName> parse(const std::string& pattern);

  std::optional<long> number(const std::string& file) const;
};

/// Names of the files of such a name in a folder. Throws InputError: the folder cannot be read, or
/// two files have the same number.
std::map<long, std::string> numberedFiles(const std::string& folder, const NumberedName& name);

/// The images of a numbered series, from time 0 at a constant rate [Hz]. `none` is thrown when
/// there are none. Throws InputError: a number is missing.
std::vector<ListedImage> numberedSeries(const std::string& folder, const NumberedName& name,
                                        double rate, const InputError& none);

/// The images of a folder that has nothing else, `fps` of them per second. Throws InputError.
std::vector<ListedImage> plainImageFolder(const std::string& folder, double fps);

/// Where a folder named in sequence.yaml is: in the sequence's folder or among ViSP's images; empty
/// when nowhere.
std::string findImageFolder(const std::string& folder, const std::string& sequenceFolder);

/// How many bits of 16 the images use whose format does not say it: the fewest of 10, 12, 14 and 16
/// that hold every level of some of them (first, last and between). 0: they have 8 bits, or say it,
/// or the first one cannot be read.
int usedBits(std::size_t images, const std::function<ImageFile(std::size_t)>& open);
int usedBits(const std::vector<std::string>& images);

}  // namespace depthservo::detail
