#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

namespace depthservo::detail {

/// Bytes of a bag are not what they should be; says why.
struct BagFault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What is held in memory at once: a message, or a chunk.
constexpr std::uint64_t kMostBytesHeld = std::uint64_t{128} << 20;

/// Bytes by their place.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;

  /// `count` bytes from `offset` on, until the next call. Throws BagFault: they are not all there,
  /// or more than are held at once.
  virtual std::string_view at(std::uint64_t offset, std::uint64_t count) = 0;

 protected:
  void require(std::uint64_t offset, std::uint64_t count) const;
};

/// Those of a file, of which a window is held.
class FileBytes : public ByteSource {
 public:
  /// Throws InputError.
  explicit FileBytes(const std::string& path);
  ~FileBytes() override;
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;

  std::uint64_t size() const override { return size_; }
  std::string_view at(std::uint64_t offset, std::uint64_t count) override;

 private:
  int file_;
  std::uint64_t size_ = 0, start_ = 0;
  std::string window_;
};

/// A part of another, counted from its own start.
class PartOfBytes : public ByteSource {
 public:
  PartOfBytes(ByteSource& whole, std::uint64_t start, std::uint64_t size)
      : whole_(whole), start_(start), size_(size) {}
  std::uint64_t size() const override { return size_; }
  std::string_view at(std::uint64_t offset, std::uint64_t count) override {
    require(offset, count);
    return whole_.at(start_ + offset, count);
  }

 private:
  ByteSource& whole_;
  std::uint64_t start_, size_;
};

/// Bytes in memory, not set at first.
class HeldBytes : public ByteSource {
 public:
  explicit HeldBytes(std::uint64_t size) : bytes_(new char[size]), size_(size) {}
  char* data() { return bytes_.get(); }
  std::uint64_t size() const override { return size_; }
  std::string_view at(std::uint64_t offset, std::uint64_t count) override {
    require(offset, count);
    return {bytes_.get() + offset, static_cast<std::size_t>(count)};
  }

 private:
  std::unique_ptr<char[]> bytes_;
  std::uint64_t size_;
};

}  // namespace depthservo::detail
