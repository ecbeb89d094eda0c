#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace depthservo::html {

/// Text as it may stand in an element or in a quoted attribute.
std::string escaped(std::string_view text);

/// The bytes of a PNG file. \throw InputError it is not one
std::string pngBytes(const std::filesystem::path& file);
/// A PNG, or an image of another kind, as the source of an image element.
std::string dataUrl(std::string_view bytes, std::string_view kind = "png");
/// The same of a file. \throw InputError it is not a PNG
std::string pngSource(const std::filesystem::path& file);

/// The template with every {{placeholder}} replaced in one pass, so that values are never searched.
std::string filled(std::string_view page,
                   const std::map<std::string_view, std::string_view>& values);

/// A page of words, tables and figures that needs nothing else, in the look of the run report.
struct Sheet {
  std::string command, name;  ///< "depthservo reproduce", "durand2010"
  std::string verdict;        ///< one sentence
  std::string mood;           ///< its CSS class: good | middling | bad | neutral
  std::string reason;         ///< one more sentence
  std::string body;           ///< HTML

  std::string page() const;
};

}  // namespace depthservo::html
