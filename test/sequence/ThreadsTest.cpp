// What may be used from several threads is. The thread sanitizer watches (preset `tsan`).

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <thread>

#include "depthservo/sequence/PushedSources.h"
#include "depthservo/sequence/Sequence.h"
#include "depthservo/text/NewFolder.h"
#include "depthservo/visp/using.h"
#include "support/TemporaryFolder.h"
#include "support/inThreads.h"

namespace depthservo::test {
namespace {

TEST(Threads, every_pushed_row_is_read_once_or_refused) {
  constexpr int kRows = 2000;
  PushedTwists twists;
  std::atomic<int> time{0};
  std::vector<OdometryRow> read;
  std::thread reader([&] {
    while (!twists.isEnded()) {
      const std::vector<OdometryRow> rows = twists.read(0.01);
      read.insert(read.end(), rows.begin(), rows.end());
      twists.takeFaults();
    }
  });
  inThreads([&](int) {
    for (int i = 0; i < kRows; ++i) twists.push({static_cast<double>(++time), {}});
  });
  twists.end();
  reader.join();
  twists.read(0);
  EXPECT_EQ(read.size(), twists.counts().rows);
  EXPECT_EQ(read.size() + twists.counts().notLater, static_cast<std::size_t>(kThreads * kRows));
  for (std::size_t i = 1; i < read.size(); ++i) EXPECT_LT(read[i - 1].time_s, read[i].time_s);
}

TEST(Threads, every_pushed_image_is_taken_or_left_out) {
  constexpr int kImages = 500;
  PushedImages::Options options;
  options.most = 4;
  PushedImages images(options);
  std::size_t taken = 0;
  std::thread reader([&] {
    for (TimedImage image; images.next(image) == ImageStatus::image; ++taken) {
      EXPECT_EQ(image.image.getSize(), 16u);
    }
  });
  inThreads([&](int) {
    for (int i = 0; i < kImages; ++i) images.push({0.1 * i, vpImage<unsigned char>(4, 4, 7)});
  });
  images.end("enough");
  reader.join();
  EXPECT_EQ(taken + images.leftOut(), static_cast<std::size_t>(kThreads * kImages));
  EXPECT_EQ(images.reason(), "enough");
}

TEST(Threads, read_the_images_of_one_bag) {
  const Sequence bag(std::string(DEPTHSERVO_BAGS) + "/lz4.mcap");
  std::vector<vpImage<unsigned char>> alone;
  for (std::size_t k = 0; k < bag.frames().size(); ++k) alone.push_back(bag.readImage(k));
  inThreads([&](int first) {
    for (std::size_t i = 0; i < alone.size(); ++i) {
      const std::size_t k = (i + 2 * static_cast<std::size_t>(first)) % alone.size();
      EXPECT_TRUE(bag.readImage(k) == alone[k]) << k;
    }
  });
}

/// The mask of the process stays, too: whoever asks for it by setting it may leave another's.
TEST(Threads, make_folders_and_files_of_their_own) {
  constexpr int kFolders = 30;
  const TemporaryFolder place;
  const mode_t mask = umask(027);
  inThreads([&](int thread) {
    for (int i = 0; i < kFolders; ++i) {
      const std::string name = std::to_string(thread) + "-" + std::to_string(i);
      makeFolder(place / name, [&](const auto& folder) { makeFile(folder / "file", name); });
      struct stat made = {};
      EXPECT_EQ(stat((place / name).c_str(), &made), 0);
      EXPECT_EQ(made.st_mode & 0777u, 0750u);
      EXPECT_EQ(place.read(name + "/file"), name);
    }
  });
  EXPECT_EQ(umask(mask), 027u);
}

}  // namespace
}  // namespace depthservo::test
