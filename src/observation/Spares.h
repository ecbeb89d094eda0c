#pragma once

#include <utility>
#include <vector>

namespace depthservo {

/// Objects that are no longer needed, kept so that their memory is used again.
template <class Object>
class Spares {
 public:
  void give(Object object) { objects_.push_back(std::move(object)); }

  /// One of them, or a new one.
  Object take() {
    if (objects_.empty()) return {};
    Object object = std::move(objects_.back());
    objects_.pop_back();
    return object;
  }

 private:
  std::vector<Object> objects_;
};

}  // namespace depthservo
