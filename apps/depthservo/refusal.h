#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace depthservo {

/// Why these arguments cannot be used and what to write instead, in one line. \param error of
/// parsing them
std::string refusal(const CLI::App& app, const CLI::ParseError& error,
                    const std::vector<std::string>& arguments);

}  // namespace depthservo
