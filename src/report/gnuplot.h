#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace depthservo::gnuplot {

/// Colour-blind safe (Okabe and Ito 2008): blue, orange, green, vermillion, purple, sky blue; and
/// grey.
constexpr const char* kColours[] = {"#0072B2", "#E69F00", "#009E73", "#D55E00",
                                    "#CC79A7", "#56B4E9", "#888888"};
const char* colour(std::size_t index);  ///< cyclic

/// A number as gnuplot reads it; NaN leaves a gap.
std::string number(double value);

/// A text as a string on one line, in single quotes, within which gnuplot executes and replaces
/// nothing: control characters become blanks, what is not UTF-8 becomes U+FFFD.
std::string quoted(std::string_view text);

/// A named block of rows, one column of numbers each.
std::string dataBlock(const std::string& name, const std::vector<std::vector<double>>& columns);

/// Begins a script that draws into a PNG file.
std::string page(const std::string& file, int width_px, int height_px);

/// Runs gnuplot in a folder on a script of that folder, silently and without the user's settings.
/// \return whether it was found and succeeded
bool run(const std::filesystem::path& folder, const std::string& script);

}  // namespace depthservo::gnuplot
