#pragma once

#include "depthservo/api.h"
#include "depthservo/depth/WindowDepthEstimator.h"

namespace depthservo {

/// The baseline of every comparison: least squares on the last two images alone.
class DEPTHSERVO_API TwoFrameLeastSquares : public WindowDepthEstimator {
 public:
  explicit TwoFrameLeastSquares(const DepthRange& range = {})
      : WindowDepthEstimator(twoFrames(), range) {}

  std::unique_ptr<DepthEstimator> clone() const override {
    return std::make_unique<TwoFrameLeastSquares>(*this);
  }

 private:
  static WindowOptions twoFrames() {
    WindowOptions options;
    options.images = 1;
    options.method = WindowMethod::leastSquares;
    return options;
  }
};

}  // namespace depthservo
