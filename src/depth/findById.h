#pragma once

#include <algorithm>
#include <cstddef>

namespace depthservo::detail {

/// The entry with this id among the first `size`, which are in use; null: there is none.
/// \param entries a vector, const or not, of what has an `id`
template <class Entries>
auto findById(Entries& entries, std::size_t size, int id) -> decltype(entries.data()) {
  const auto end = entries.data() + size;
  const auto found =
      std::find_if(entries.data(), end, [id](const auto& entry) { return entry.id == id; });
  return found == end ? nullptr : found;
}

}  // namespace depthservo::detail
