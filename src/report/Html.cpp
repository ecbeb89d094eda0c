#include "report/Html.h"

#include "depthservo/text/InputError.h"
#include "report/EmbeddedReport.h"
#include "text/TextFile.h"
#include "text/base64.h"

namespace depthservo::html {
namespace {

/// Largest image that is read [bytes].
constexpr std::size_t kLargestFile = std::size_t{1} << 28;

}  // namespace

std::string escaped(std::string_view text) {
  std::string html;
  for (const char c : text) {
    switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      case '\'':
        html += "&#39;";
        break;
      default:
        html += c;
    }
  }
  return html;
}

std::string pngBytes(const std::filesystem::path& file) {
  std::string bytes = detail::readFile(file.string(), kLargestFile);
  if (bytes.compare(0, 8, "\x89PNG\r\n\x1a\n") != 0) {
    throw InputError({file.string(), 0, ""}, "is not a PNG image");
  }
  return bytes;
}

std::string dataUrl(std::string_view bytes, std::string_view kind) {
  return "data:image/" + std::string(kind) + ";base64," + detail::base64(bytes);
}

std::string pngSource(const std::filesystem::path& file) { return dataUrl(pngBytes(file)); }

std::string filled(std::string_view page,
                   const std::map<std::string_view, std::string_view>& values) {
  std::string html;
  for (std::size_t begin = 0;;) {
    const std::size_t open = page.find("{{", begin);
    html += page.substr(begin, open - begin);
    if (open == std::string_view::npos) return html;
    const std::size_t close = page.find("}}", open);
    html += values.at(page.substr(open + 2, close - open - 2));
    begin = close + 2;
  }
}

std::string Sheet::page() const {
  const std::string safeName = escaped(name), safeVerdict = escaped(verdict),
                    safeReason = escaped(reason);
  return filled(embeddedReport().sheet, {{"command", command},
                                         {"name", safeName},
                                         {"mood", mood},
                                         {"verdict", safeVerdict},
                                         {"reason", safeReason},
                                         {"body", body},
                                         {"version", DEPTHSERVO_VERSION},
                                         {"style", embeddedReport().style}});
}

}  // namespace depthservo::html
