#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>

#include "sequence/ImageFile.h"

// jpeglib.h needs <cstddef> and <cstdio> before it.
// clang-format off
#include <jpeglib.h>
#include <jerror.h>
// clang-format on

namespace depthservo::detail {
namespace {

/// The state of libjpeg, which reports an error by a jump: between `setjmp` and the call that may
/// fail no object with a destructor may be made.
struct JpegReader {
  jpeg_decompress_struct jpeg{};
  jpeg_error_mgr errors{};
  std::jmp_buf jump;
  char reason[JMSG_LENGTH_MAX] = "";

  explicit JpegReader(std::string_view bytes) {
    jpeg.err = jpeg_std_error(&errors);
    jpeg.client_data = this;
    errors.error_exit = fail;
    errors.emit_message = warn;
    if (setjmp(jump)) throw ImageFault(reason);
    jpeg_create_decompress(&jpeg);
    jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
    jpeg_save_markers(&jpeg, JPEG_APP0 + 1, 0xFFFF);
  }
  ~JpegReader() { jpeg_destroy_decompress(&jpeg); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  static void fail(j_common_ptr jpeg) {
    auto* self = static_cast<JpegReader*>(jpeg->client_data);
    jpeg->err->format_message(jpeg, self->reason);
    std::longjmp(self->jump, 1);
  }

  /// What libjpeg goes on after is damage, but for bytes between the parts, as some cameras have.
  static void warn(j_common_ptr jpeg, int level) {
    if (level < 0 && jpeg->err->msg_code != JWRN_EXTRANEOUS_DATA) fail(jpeg);
  }

  void readHeader() {
    if (setjmp(jump)) throw ImageFault(reason);
    jpeg_read_header(&jpeg, TRUE);
  }

  /// After readHeader.
  void readPixels(unsigned char* levels) {
    if (setjmp(jump)) throw ImageFault(reason);
    jpeg.out_color_space = JCS_GRAYSCALE;
    jpeg_start_decompress(&jpeg);
    while (jpeg.output_scanline < jpeg.output_height) {
      JSAMPROW row = levels + std::size_t(jpeg.output_scanline) * jpeg.output_width;
      jpeg_read_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_decompress(&jpeg);
  }
};

ImageHeader header(std::string_view bytes) {
  JpegReader reader(bytes);
  reader.readHeader();
  const auto space = reader.jpeg.jpeg_color_space;
  if (space == JCS_CMYK || space == JCS_YCCK) throw ImageFault("it is for print (CMYK)");
  ImageHeader header;
  header.size = {static_cast<int>(reader.jpeg.image_width),
                 static_cast<int>(reader.jpeg.image_height)};
  header.white = 255;
  header.isGray = reader.jpeg.num_components == 1;
  for (auto marker = reader.jpeg.marker_list; marker; marker = marker->next) {
    const std::string_view data(reinterpret_cast<const char*>(marker->data), marker->data_length);
    constexpr std::string_view kExif("Exif\0\0", 6);
    if (data.substr(0, kExif.size()) == kExif) {
      header.orientation = exifOrientation(data.substr(kExif.size()));
      break;
    }
  }
  return header;
}

void decode(std::string_view bytes, const ImageHeader&, void* levels) {
  JpegReader reader(bytes);
  reader.readHeader();
  reader.readPixels(static_cast<unsigned char*>(levels));
}

}  // namespace

ImageFormat jpegFormat() { return {header, decode}; }

std::string jpegOf(const unsigned char* gray, ImageSize size, int quality) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);  // ends the program when memory does, nothing else can fail
  jpeg_create_compress(&jpeg);
  unsigned char* bytes = nullptr;
  unsigned long count = 0;
  jpeg_mem_dest(&jpeg, &bytes, &count);
  jpeg.image_width = static_cast<JDIMENSION>(size.width);
  jpeg.image_height = static_cast<JDIMENSION>(size.height);
  jpeg.input_components = 1;
  jpeg.in_color_space = JCS_GRAYSCALE;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, quality, TRUE);
  jpeg_start_compress(&jpeg, TRUE);
  while (jpeg.next_scanline < jpeg.image_height) {
    auto* row =
        const_cast<unsigned char*>(gray) + std::size_t(jpeg.next_scanline) * jpeg.image_width;
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  std::string file(reinterpret_cast<const char*>(bytes), count);
  jpeg_destroy_compress(&jpeg);
  std::free(bytes);
  return file;
}

int exifOrientation(std::string_view tiff) {
  if (tiff.size() < 8) return 1;
  const bool isLittle = tiff[0] == 'I';
  const auto number = [&](std::size_t at, std::size_t size) -> std::optional<std::size_t> {
    if (at > tiff.size() || tiff.size() - at < size) return std::nullopt;
    std::size_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      value = value << 8 | static_cast<unsigned char>(tiff[at + (isLittle ? size - 1 - i : i)]);
    }
    return value;
  };
  constexpr std::size_t kEntry = 12, kOrientation = 0x0112;
  const auto directory = number(4, 4);
  const auto count = directory ? number(*directory, 2) : std::nullopt;
  for (std::size_t i = 0; count && i < *count; ++i) {
    const std::size_t entry = *directory + 2 + i * kEntry;
    const auto tag = number(entry, 2);
    if (!tag) return 1;
    if (*tag != kOrientation) continue;
    const auto value = number(entry + 8, 2);
    return value && *value >= 1 && *value <= 8 ? static_cast<int>(*value) : 1;
  }
  return 1;
}

}  // namespace depthservo::detail
