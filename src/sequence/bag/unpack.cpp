#include "sequence/bag/unpack.h"

#include <bzlib.h>
#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

namespace depthservo::detail {
namespace {

[[noreturn]] void failUnpacking(const std::string& reason) {
  throw BagFault("it cannot be unpacked: " + reason);
}

std::uint64_t unpackLz4(std::string_view packed, HeldBytes& out) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION))) {
    failUnpacking("no memory");
  }
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      made, LZ4F_freeDecompressionContext);
  std::uint64_t done = 0;
  std::size_t rest = 1;
  while (rest != 0 && !packed.empty()) {
    std::size_t room = static_cast<std::size_t>(out.size() - done), taken = packed.size();
    rest = LZ4F_decompress(context.get(), out.data() + done, &room, packed.data(), &taken, nullptr);
    if (LZ4F_isError(rest)) failUnpacking(std::string("lz4: ") + LZ4F_getErrorName(rest));
    if (room == 0 && taken == 0) failUnpacking("lz4: more comes out than its size says");
    done += room;
    packed.remove_prefix(taken);
  }
  if (rest != 0) failUnpacking("lz4: it is cut off");
  return done;
}

std::uint64_t unpackZstd(std::string_view packed, HeldBytes& out) {
  const std::size_t size = ZSTD_decompress(out.data(), static_cast<std::size_t>(out.size()),
                                           packed.data(), packed.size());
  if (ZSTD_isError(size)) failUnpacking(std::string("zstd: ") + ZSTD_getErrorName(size));
  return size;
}

std::uint64_t unpackBz2(std::string_view packed, HeldBytes& out) {
  auto size = static_cast<unsigned>(out.size());
  std::string copy(packed);  // bzlib takes no constants
  const int result = BZ2_bzBuffToBuffDecompress(out.data(), &size, copy.data(),
                                                static_cast<unsigned>(copy.size()), 0, 0);
  if (result != BZ_OK) failUnpacking(fmt::format("bz2: error {}", result));
  return size;
}

}  // namespace

std::unique_ptr<HeldBytes> unpack(std::string_view packed, const std::string& packing,
                                  std::uint64_t size) {
  if (size > kMostBytesHeld) {
    failUnpacking(
        fmt::format("its header tells {} bytes; up to {} are unpacked", size, kMostBytesHeld));
  }
  constexpr std::uint64_t kMostByLz4 = 256;  // bytes that come of one, and a little
  if (packing == "lz4" && size / kMostByLz4 > packed.size()) {
    failUnpacking(fmt::format("lz4: {} bytes cannot hold {}", packed.size(), size));
  }
  auto out = std::make_unique<HeldBytes>(size);
  std::uint64_t got = 0;
  if (packing == "lz4") {
    got = unpackLz4(packed, *out);
  } else if (packing == "zstd") {
    got = unpackZstd(packed, *out);
  } else if (packing == "bz2") {
    got = unpackBz2(packed, *out);
  } else {
    failUnpacking(fmt::format("packed by '{}', expected lz4, zstd or bz2", packing.substr(0, 20)));
  }
  if (got != size) failUnpacking(fmt::format("{} bytes come out, {} are told", got, size));
  return out;
}

bool isZstd(std::string_view bytes) { return bytes.substr(0, 4) == "\x28\xB5\x2F\xFD"; }

std::uint64_t zstdSize(std::string_view bytes) {
  const auto size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN) {
    failUnpacking("zstd: it does not say its size");
  }
  return size;
}

}  // namespace depthservo::detail
