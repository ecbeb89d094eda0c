#pragma once

namespace depthservo {

constexpr int kMet = 0;           ///< as expected; without an expectation: converged or timeout
constexpr int kNotMet = 1;        ///< an expectation or a baseline is not met
constexpr int kBadInput = 2;      ///< arguments or files that cannot be used; nothing was written
constexpr int kOtherOutcome = 3;  ///< without an expectation: any other outcome
constexpr int kStoppedBySafety = 4;  ///< servo
constexpr int kInterrupted = 130;    ///< servo, by Ctrl-C
constexpr int kInternalError = 70;   ///< nothing that the user can mend (EX_SOFTWARE of sysexits.h)

}  // namespace depthservo
