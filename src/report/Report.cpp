#include "depthservo/report/Report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "depthservo/text/InputError.h"
#include "report/EmbeddedReport.h"
#include "report/Html.h"
#include "report/PageData.h"
#include "report/RunFiles.h"
#include "report/headline.h"
#include "sequence/GrayImage.h"
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
                    images = imageElements(folder), data = pageData(run, folder);
  const EmbeddedReport& report = embeddedReport();
  return html::filled(report.page, {{"command", command},
                                    {"name", name},
                                    {"reason", reason},
                                    {"mood", headline.mood},
                                    {"verdict", sentence},
                                    {"diagnosis", diagnosis},
                                    {"images", images},
                                    {"data", data},
                                    {"style", report.style},
                                    {"script", report.script}});
}

}  // namespace

void writeReport(const fs::path& runFolder) {
  const fs::path runFile = runFolder / "run.json", partial = runFolder / ".report.html";
  try {
    const Json run = Json::parse(detail::readFile(runFile.string(), kLargestFile));
    writeFile(partial, reportPage(runFolder, run));
    fs::rename(partial, runFolder / "report.html");
  } catch (const Json::exception& error) {
    throw InputError({runFile.string(), 0, ""}, error.what());
  } catch (const fs::filesystem_error& error) {
    std::error_code ignored;
    fs::remove(partial, ignored);
    throw InputError({(runFolder / "report.html").string(), 0, ""},
                     "cannot be written: " + error.code().message());
  }
}

}  // namespace depthservo
