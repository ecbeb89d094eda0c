#pragma once

#include <CLI/CLI.hpp>

namespace depthservo {

/// Checks of numbers on the command line, with messages that people can read: "expected a number in
/// [0, 10], got '50'".
CLI::Validator within(double low, double high);
CLI::Validator aboveZero();
CLI::Validator zeroOrMore();

}  // namespace depthservo
