#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "sequence/bag/ByteSource.h"

namespace depthservo::detail {

/// Unpacks what is packed by "lz4" (frames), "zstd" or "bz2". \param size of what comes out; more
/// is never unpacked \throw BagFault another packing, damage, or another size
std::unique_ptr<HeldBytes> unpack(std::string_view packed, const std::string& packing,
                                  std::uint64_t size);

/// Whether bytes begin as a zstd frame that says its size, and that size.
bool isZstd(std::string_view bytes);
std::uint64_t zstdSize(std::string_view bytes);  ///< \throw BagFault it does not say

}  // namespace depthservo::detail
