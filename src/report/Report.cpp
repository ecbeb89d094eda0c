#include "depthservo/report/Report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "depthservo/text/InputError.h"
#include "depthservo/text/NewFolder.h"
#include "report/EmbeddedReport.h"
#include "report/Html.h"
#include "report/PageData.h"
#include "report/headline.h"
#include "sequence/ImageFile.h"
#include "text/TextFile.h"

namespace depthservo {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Largest file that is read [bytes].
constexpr std::size_t kLargestFile = std::size_t{1} << 28;

std::string capitalised(std::string sentence) {
  if (!sentence.empty() && sentence[0] >= 'a' && sentence[0] <= 'z') sentence[0] -= 'a' - 'A';
  return sentence;
}

/// No wider or higher than a page can show: the size of the page stays within bounds.
std::string imageSource(const fs::path& file) {
  constexpr int kLargest_px = 1280;
  const detail::ImageFile image(file.string());
  const detail::ImageSize size = image.size();
  const double scale = static_cast<double>(kLargest_px) / std::max({size.width, size.height, 1});
  if (scale >= 1) return html::dataUrl(html::pngBytes(file));
  auto gray = image.gray();
  cv::Mat small;
  cv::resize(cv::Mat(size.height, size.width, CV_8UC1, gray.bitmap), small, {}, scale, scale,
             cv::INTER_AREA);
  return html::dataUrl(detail::pngOf(small.ptr(), {small.cols, small.rows}, -1));
}

std::string imageElements(const fs::path& folder) {
  std::string elements;
  for (const char* stem : {"first", "last"}) {
    const fs::path file = folder / fmt::format("{}.png", stem);
    if (!fs::exists(file)) continue;
    elements += fmt::format(R"(<img id="image-{0}" alt="{0} camera image" src="{1}">)", stem,
                            imageSource(file));
  }
  return elements;
}

/// Pictures of the run's film, evenly spread: pairs of a time [s] and the source of an image.
std::string filmJson(const fs::path& folder) {
  constexpr std::size_t kMostPictures = 60;
  std::vector<std::pair<double, fs::path>> pictures;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder / "film", none)) {
    const auto time_s = detail::toNumber(entry.path().stem().string());
    if (!time_s || entry.path().extension() != ".jpg") {
      throw InputError({entry.path().string(), 0, ""}, "expected a picture named by its time");
    }
    pictures.emplace_back(*time_s, entry.path());
  }
  std::sort(pictures.begin(), pictures.end());
  const std::size_t every = (pictures.size() + kMostPictures - 1) / kMostPictures;
  std::string json;
  for (std::size_t i = 0; i < pictures.size(); i += every) {
    const std::string bytes = detail::readFile(pictures[i].second.string(), kLargestFile);
    if (bytes.compare(0, 2, "\xFF\xD8") != 0) {
      throw InputError({pictures[i].second.string(), 0, ""}, "is not a JPEG image");
    }
    json += fmt::format("{}[{:.9f},\"{}\"]", json.empty() ? "" : ",", pictures[i].first,
                        html::dataUrl(bytes, "jpeg"));
  }
  return '[' + json + ']';
}

/// What images and odometry disagree about, if anything.
std::string diagnosisElement(const Json& run) {
  if (!run.contains("diagnosis")) return "";
  const Json& diagnosis = run.at("diagnosis");
  if (diagnosis.at("cause") == "none") return "";
  return fmt::format(R"(<p class="diagnosis"><b>Self-diagnosis</b> {}</p>)",
                     html::escaped(diagnosis.at("message").get<std::string>()));
}

std::string reportPage(const fs::path& folder, const Json& run) {
  const auto text = [&](const char* key) { return html::escaped(run.at(key).get<std::string>()); };
  const Headline headline = headlineOf(run);
  std::string reason = text("reason");
  if (run.contains("frame_rate")) {
    reason += (reason.empty() ? "" : ". ") +
              html::escaped(capitalised(run.at("frame_rate").at("sentence").get<std::string>()));
  }
  const std::string command = text("command"), name = text("name"),
                    sentence = html::escaped(headline.sentence), diagnosis = diagnosisElement(run),
                    images = imageElements(folder), film = filmJson(folder),
                    data = pageData(run, folder);
  const EmbeddedReport& report = embeddedReport();
  return html::filled(report.page, {{"command", command},
                                    {"name", name},
                                    {"reason", reason},
                                    {"mood", headline.mood},
                                    {"verdict", sentence},
                                    {"diagnosis", diagnosis},
                                    {"images", images},
                                    {"film", film},
                                    {"data", data},
                                    {"style", report.style},
                                    {"script", report.script}});
}

/// The page of a run folder as it stands in its files.
std::string pageOf(const fs::path& folder) {
  const fs::path file = folder / "run.json";
  try {
    return reportPage(folder, Json::parse(detail::readFile(file.string(), kLargestFile)));
  } catch (const Json::exception& error) {
    throw InputError({file.string(), 0, ""}, error.what());
  }
}

}  // namespace

void writeReport(const fs::path& runFolder) {
  replaceFile(runFolder / "report.html", pageOf(runFolder));
}

void writeReportOfTwo(const fs::path& one, const fs::path& other, const fs::path& file) {
  const std::string left = html::escaped(pageOf(one)), right = html::escaped(pageOf(other)),
                    leftName = html::escaped(one.string()),
                    rightName = html::escaped(other.string());
  const EmbeddedReport& report = embeddedReport();
  makeFile(file, html::filled(report.pair, {{"left", left},
                                            {"right", right},
                                            {"playback", report.playback},
                                            {"left_name", leftName},
                                            {"right_name", rightName}}));
}

}  // namespace depthservo
