#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/imgcodecs.hpp>

#include "sequence/ImageFile.h"
#include "support/InputErrors.h"
#include "support/TemporaryFolder.h"

namespace depthservo::detail {
namespace {

using test::inputErrorOf;
using test::isRefusal;

std::string text(const std::vector<unsigned char>& bytes) { return {bytes.begin(), bytes.end()}; }

std::string encoded(const char* format, const cv::Mat& pixels) {
  std::vector<unsigned char> bytes;
  cv::imencode(format, pixels, bytes);
  return text(bytes);
}

/// Noise on a slope, so that JPEG has something to keep.
cv::Mat picture(int type) {
  cv::Mat noise(37, 53, type), slope(37, 53, type);
  cv::randu(noise, cv::Scalar::all(0), cv::Scalar::all(120));
  for (int v = 0; v < slope.rows; ++v) slope.row(v).setTo(cv::Scalar(3 * v, 2 * v, v, 255));
  return noise + slope;
}

std::string bigEndian(std::uint64_t value, int bytes) {
  std::string digits;
  for (int i = bytes - 1; i >= 0; --i) digits += static_cast<char>(value >> (8 * i) & 0xFF);
  return digits;
}

std::string chunk(const std::string& type, const std::string& data) {
  std::uint32_t crc = 0xFFFFFFFFu;
  for (const char c : type + data) {
    crc ^= static_cast<unsigned char>(c);
    for (int k = 0; k < 8; ++k) crc = crc & 1 ? 0xEDB88320u ^ (crc >> 1) : crc >> 1;
  }
  return bigEndian(static_cast<unsigned>(data.size()), 4) + type + data + bigEndian(~crc, 4);
}

/// TIFF with one entry in its first directory: the orientation.
std::string exif(unsigned orientation, bool isLittle) {
  if (!isLittle) {
    return "MM" + bigEndian(42, 2) + bigEndian(8, 4) + bigEndian(1, 2) + bigEndian(0x0112, 2) +
           bigEndian(3, 2) + bigEndian(1, 4) + bigEndian(orientation, 2) + bigEndian(0, 6);
  }
  const char entry[] = {'I', 'I', 42, 0, 8, 0, 0, 0, 1, 0, 0x12, 1, 3, 0, 1, 0, 0, 0};
  return std::string(entry, sizeof entry) + static_cast<char>(orientation) + std::string(7, '\0');
}

class ImageFileTest : public testing::Test {
 protected:
  ImageFile file(const std::string& bytes) const {
    folder_.write("image", bytes);
    return ImageFile(folder_ / "image");
  }
  std::string refusal(const std::string& bytes, int bits = 16) const {
    return inputErrorOf([&] { file(bytes).gray(bits); });
  }
  test::TemporaryFolder folder_;
};

TEST_F(ImageFileTest, has_the_pixels_that_opencv_reads) {
  for (const char* format : {".png", ".jpg", ".ppm", ".pgm"}) {
    for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4}) {
      if (std::string(format) == ".ppm" ? type != CV_8UC3
                                        : std::string(format) != ".png" && type == CV_8UC4) {
        continue;
      }
      if (std::string(format) == ".pgm" && type != CV_8UC1) continue;
      const std::string bytes = encoded(format, picture(type));
      const cv::Mat coded(1, static_cast<int>(bytes.size()), CV_8U,
                          const_cast<char*>(bytes.data()));
      const cv::Mat expected = cv::imdecode(coded, cv::IMREAD_GRAYSCALE);
      const auto image = file(bytes).gray();
      ASSERT_EQ(image.getSize(), expected.total()) << format << type;
      EXPECT_EQ(std::memcmp(image.bitmap, expected.ptr(), image.getSize()), 0) << format << type;
    }
  }
}

TEST_F(ImageFileTest, written_as_png_has_its_pixels_for_opencv) {
  const cv::Mat pixels = picture(CV_8UC1);
  for (const int compression : {-1, 1}) {
    const std::string bytes = pngOf(pixels.ptr(), {pixels.cols, pixels.rows}, compression);
    const cv::Mat coded(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data()));
    const cv::Mat read = cv::imdecode(coded, cv::IMREAD_UNCHANGED);
    ASSERT_EQ(read.size(), pixels.size());
    ASSERT_EQ(read.type(), CV_8UC1);
    EXPECT_EQ(std::memcmp(read.ptr(), pixels.ptr(), pixels.total()), 0) << compression;
  }
}

TEST_F(ImageFileTest, of_a_pnm_is_scaled_by_its_greatest_level) {
  const auto pixel = [&](const std::string& bytes) { return int(file(bytes).gray()[0][0]); };
  EXPECT_EQ(pixel("P5 1 1 1023\n" + bigEndian(1023, 2)), 255);
  EXPECT_EQ(pixel("P5 1 1 1023\n" + bigEndian(512, 2)), 128);
  EXPECT_EQ(pixel("P5 1 1 65535\n" + bigEndian(257 * 77, 2)), 77);
  EXPECT_EQ(pixel("P5 1 1 100\n" + bigEndian(50, 1)), 128);
  EXPECT_EQ(pixel("P6 1 1 16383\n" + bigEndian(16383, 2) + bigEndian(0, 4)), 76);  // red
  EXPECT_TRUE(isRefusal(refusal("P5 1 1 1023\n" + bigEndian(1024, 2)), {"image", "above"}));
  EXPECT_TRUE(isRefusal(refusal("P5 1 1 70000\n??"), {"image", "65535"}));
  EXPECT_TRUE(isRefusal(refusal("P5 2 1 1023\n???"), {"image", "pixels are missing"}));
}

TEST_F(ImageFileTest, of_16_bits_is_scaled_by_the_bits_in_use) {
  const cv::Mat levels = (cv::Mat_<unsigned short>(1, 3) << 0, 500, 1000);
  const ImageFile image = file(encoded(".png", levels));
  EXPECT_TRUE(image.isWhiteUnknown());
  EXPECT_TRUE(image.isDepth());
  EXPECT_EQ(int(image.gray(10)[0][2]), 249);
  EXPECT_EQ(int(image.gray(12)[0][1]), 31);
  EXPECT_EQ(int(image.gray(16)[0][2]), 4);
  EXPECT_TRUE(isRefusal(inputErrorOf([&] { image.gray(9); }), {"1000", "9 of 16", "image_bits"}));
  const ImageFile colour = file(encoded(".png", cv::Mat(2, 2, CV_16UC3, cv::Scalar(0, 0, 60000))));
  EXPECT_FALSE(colour.isDepth());
  EXPECT_NEAR(colour.gray()[1][1], 0.299 * 60000 / 257, 1);
}

TEST_F(ImageFileTest, too_large_to_unpack_is_refused_by_its_header) {
  std::string bomb = encoded(".png", cv::Mat(1, 1, CV_8U, cv::Scalar(0)));
  for (const unsigned side : {20000u, 9000u}) {
    bomb.replace(8, 25,
                 chunk("IHDR", bigEndian(side, 4) + bigEndian(side, 4) + bomb.substr(24, 5)));
    EXPECT_TRUE(isRefusal(refusal(bomb), {"image", std::to_string(side), "64 million"}));
  }
  EXPECT_TRUE(isRefusal(refusal("P5 16384 16384 255\n"), {"image", "64 million"}));
  EXPECT_TRUE(isRefusal(refusal("P5 0 5 255\n"), {"image", "0x5"}));
}

TEST_F(ImageFileTest, to_be_shown_turned_is_refused) {
  const std::string jpeg = encoded(".jpg", picture(CV_8UC3));
  const std::string png = encoded(".png", picture(CV_8UC3));
  for (const bool isLittle : {true, false}) {
    for (const unsigned orientation : {1u, 3u, 6u, 8u}) {
      const std::string tiff = exif(orientation, isLittle),
                        block = std::string("Exif\0\0", 6) + tiff;
      std::string turned = jpeg;
      turned.insert(2, "\xFF\xE1" + bigEndian(static_cast<unsigned>(block.size()) + 2, 2) + block);
      std::string turnedPng = png;
      turnedPng.insert(33, chunk("eXIf", tiff));
      for (const std::string& bytes : {turned, turnedPng}) {
        if (orientation == 1) {
          EXPECT_EQ(refusal(bytes), "");
        } else {
          EXPECT_TRUE(isRefusal(refusal(bytes), {"turned", std::to_string(orientation), "exif"}));
        }
      }
    }
  }
  EXPECT_EQ(exifOrientation("II*"), 1);
  EXPECT_EQ(exifOrientation(exif(6, true).substr(0, 16)), 1);
  EXPECT_EQ(exifOrientation("MM" + bigEndian(42, 2) + bigEndian(0xFFFFFFF0u, 4)), 1);
}

TEST_F(ImageFileTest, damaged_says_what_is_wrong) {
  const std::string jpeg = encoded(".jpg", picture(CV_8UC3)), png = encoded(".png", picture(CV_8U));
  EXPECT_TRUE(isRefusal(refusal(jpeg.substr(0, jpeg.size() / 2)), {"image", "cut off", "JPEG"}));
  EXPECT_TRUE(isRefusal(refusal(png.substr(0, png.size() / 2)), {"image", "the end is missing"}));
  std::string flipped = png;
  flipped[png.size() / 2] = static_cast<char>(flipped[png.size() / 2] ^ 4);
  EXPECT_TRUE(isRefusal(refusal(flipped), {"image", "damaged"}));
}

}  // namespace
}  // namespace depthservo::detail
