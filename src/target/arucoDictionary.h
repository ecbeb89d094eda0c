#pragma once

#include <opencv2/aruco/dictionary.hpp>
#include <string>

namespace depthservo::detail {

/// \throws std::invalid_argument no such dictionary; names those that are
cv::Ptr<cv::aruco::Dictionary> arucoDictionary(const std::string& name);

}  // namespace depthservo::detail
