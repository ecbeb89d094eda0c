#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <vector>

#include "sequence/ImageFile.h"

namespace depthservo::detail {
namespace {

/// The state of libpng, which reports an error by a jump: between `setjmp` and the call that may
/// fail no object with a destructor may be made.
struct Png {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string_view rest;  // to be read
  std::string written;
  char reason[128] = "out of memory";

  static void fail(png_structp png, png_const_charp message) {
    auto* self = static_cast<Png*>(png_get_error_ptr(png));
    std::snprintf(self->reason, sizeof self->reason, "%s", message);
    png_longjmp(png, 1);
  }
  static void ignore(png_structp, png_const_charp) {}

  static void read(png_structp png, png_bytep to, std::size_t count) {
    auto* self = static_cast<Png*>(png_get_io_ptr(png));
    if (count > self->rest.size()) png_error(png, "the end is missing");
    std::copy_n(self->rest.data(), count, to);
    self->rest.remove_prefix(count);
  }
  static void write(png_structp png, png_bytep from, std::size_t count) {
    auto* self = static_cast<Png*>(png_get_io_ptr(png));
    self->written.append(reinterpret_cast<const char*>(from), count);
  }
  static void flush(png_structp) {}
};

struct PngReader : Png {
  explicit PngReader(std::string_view bytes) {
    rest = bytes;
    png = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, fail, ignore);
    if (png) info = png_create_info_struct(png);
    if (!info) throw ImageFault(reason);
    png_set_read_fn(png, this, read);
    png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
  }
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  /// Up to the pixels.
  void readInfo() {
    if (setjmp(png_jmpbuf(png))) throw ImageFault(reason);
    png_read_info(png, info);
  }

  /// After readInfo.
  void readPixels(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png))) throw ImageFault(reason);
    if (png_get_bit_depth(png, info) == 16) {
      const std::uint16_t one = 1;
      if (*reinterpret_cast<const unsigned char*>(&one)) png_set_swap(png);
    }
    png_set_strip_alpha(png);
    if (png_get_color_type(png, info) == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png);
    png_set_expand_gray_1_2_4_to_8(png);
    png_set_rgb_to_gray(png, PNG_ERROR_ACTION_NONE, 0.299, 0.587);
    png_set_interlace_handling(png);
    png_read_update_info(png, info);
    png_read_image(png, rows);
    png_read_end(png, nullptr);
  }
};

ImageHeader header(std::string_view bytes) {
  PngReader reader(bytes);
  reader.readInfo();
  ImageHeader header;
  header.size = {static_cast<int>(png_get_image_width(reader.png, reader.info)),
                 static_cast<int>(png_get_image_height(reader.png, reader.info))};
  header.bytes = png_get_bit_depth(reader.png, reader.info) == 16 ? 2 : 1;
  header.white = header.bytes == 1 ? 255 : 0;
  constexpr std::size_t kDensest = 1032;  // what deflate makes of one byte at most
  header.leastBytes =
      png_get_rowbytes(reader.png, reader.info) * std::size_t(header.size.height) / kDensest;
  header.isGray = png_get_color_type(reader.png, reader.info) == PNG_COLOR_TYPE_GRAY;
  png_bytep exif = nullptr;
  png_uint_32 count = 0;
  if (png_get_eXIf_1(reader.png, reader.info, &count, &exif)) {
    header.orientation = exifOrientation({reinterpret_cast<const char*>(exif), count});
  }
  return header;
}

void decode(std::string_view bytes, const ImageHeader& header, void* levels) {
  PngReader reader(bytes);
  reader.readInfo();
  const std::size_t rowBytes = std::size_t(header.size.width) * std::size_t(header.bytes);
  std::vector<png_bytep> rows(static_cast<std::size_t>(header.size.height));
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i] = static_cast<png_bytep>(levels) + i * rowBytes;
  reader.readPixels(rows.data());
}

struct PngWriter : Png {
  PngWriter() {
    png = png_create_write_struct(PNG_LIBPNG_VER_STRING, this, fail, ignore);
    if (png) info = png_create_info_struct(png);
    if (!info) throw ImageFault(reason);
    png_set_write_fn(png, this, write, flush);
  }
  ~PngWriter() { png_destroy_write_struct(&png, &info); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;

  void writeImage(const unsigned char* gray, ImageSize size, int level) {
    if (setjmp(png_jmpbuf(png))) throw ImageFault(reason);
    if (level < 0) png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_set_compression_level(png, level < 0 ? 1 : level);
    constexpr int kRuns = 3;  // zlib's Z_RLE: quick, and best for drawn images
    png_set_compression_strategy(png, kRuns);
    png_set_IHDR(png, info, static_cast<png_uint_32>(size.width),
                 static_cast<png_uint_32>(size.height), 8, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    for (int row = 0; row < size.height; ++row) {
      png_write_row(png, gray + std::size_t(row) * std::size_t(size.width));
    }
    png_write_end(png, info);
  }
};

}  // namespace

ImageFormat pngFormat() { return {header, decode}; }

std::string pngOf(const unsigned char* gray, ImageSize size, int level) {
  PngWriter writer;
  writer.writeImage(gray, size, level);
  return std::move(writer.written);
}

}  // namespace depthservo::detail
