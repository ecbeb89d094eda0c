#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>

#include "depthservo/sequence/VideoSource.h"
#include "depthservo/visp/using.h"
#include "sequence/ImagePipe.h"
#include "support/TemporaryFolder.h"

namespace depthservo::test {
namespace {

class ImagePipe : public testing::Test {
 protected:
  ImagePipe() {
    EXPECT_EQ(mkfifo(path_.c_str(), 0600), 0);
    VideoOptions options;
    options.first_s = options.silence_s = 0.05;
    source_ = std::make_unique<VideoSource>(path_, options);
    out_ = open(path_.c_str(), O_WRONLY);
  }
  ~ImagePipe() override { close(); }

  void close() {
    if (out_ >= 0) ::close(out_);
    out_ = -1;
  }
  void write(const std::string& bytes) {
    ASSERT_EQ(::write(out_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  static std::string image(double time_s, unsigned char gray) {
    std::string bytes;
    detail::appendTo(bytes, time_s, vpImage<unsigned char>(4, 6, gray));
    return bytes;
  }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "images";
  std::unique_ptr<VideoSource> source_;
  int out_ = -1;
  TimedImage image_;
};

TEST_F(ImagePipe, gives_an_image_with_its_time) {
  EXPECT_TRUE(source_->isLive());
  write(image(1764266349.123456789, 7));
  ASSERT_EQ(source_->next(image_), ImageStatus::image);
  EXPECT_NEAR(image_.time_s, 1764266349.123456789, 1e-6);
  EXPECT_EQ(image_.image.getWidth(), 6u);
  EXPECT_EQ(image_.image.getHeight(), 4u);
  EXPECT_EQ(image_.image[3][5], 7);
}

TEST_F(ImagePipe, gives_the_newest_of_those_that_wait) {
  write(image(1, 1) + image(2, 2) + image(3, 3));
  ASSERT_EQ(source_->next(image_), ImageStatus::image);
  EXPECT_EQ(image_.time_s, 3);
  EXPECT_EQ(source_->leftOut(), 2u);
}

TEST_F(ImagePipe, waits_for_the_rest_of_an_image) {
  const std::string bytes = image(1, 9);
  for (std::size_t cut = 1; cut + 1 < bytes.size(); cut += 7) {
    write(bytes.substr(0, cut));
    // Not whole yet: the image before is not given again either.
    write(bytes.substr(cut));
    ASSERT_EQ(source_->next(image_), ImageStatus::image) << cut;
    ASSERT_EQ(image_.image[0][0], 9);
  }
}

TEST_F(ImagePipe, leaves_out_what_is_no_image) {
  write("rubbish\nP6\n4 4\n255\nxx" + image(1, 1).substr(10) + "P5\n-3 4\n255\n" +
        "P5\n4 6\n65535\n" + image(5, 5));
  ASSERT_EQ(source_->next(image_), ImageStatus::image);
  EXPECT_EQ(image_.time_s, 5);
  EXPECT_EQ(image_.image[0][0], 5);
}

TEST_F(ImagePipe, an_image_without_a_stamp_has_the_time_of_now) {
  write("P5\n2 1\n255\nab");
  ASSERT_EQ(source_->next(image_), ImageStatus::image);
  EXPECT_GT(image_.time_s, 1.7e9);
  EXPECT_EQ(image_.image[0][1], 'b');
}

TEST_F(ImagePipe, ends_when_its_writer_is_silent_or_has_gone) {
  EXPECT_EQ(source_->next(image_), ImageStatus::ended);
  EXPECT_EQ(source_->reason(), "no image for 0.05 s");
  write(image(1, 1));
  close();
  EXPECT_EQ(source_->next(image_), ImageStatus::image) << "what was written is read";
  EXPECT_EQ(source_->next(image_), ImageStatus::ended);
  EXPECT_EQ(source_->reason(), "whoever wrote the images has gone");
}

}  // namespace
}  // namespace depthservo::test
