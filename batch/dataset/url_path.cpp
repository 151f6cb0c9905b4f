#include "batch/dataset/url_path.h"

#include <fmt/format.h>

namespace terracast::batch {

std::string url_path(std::string_view path) {
  // A path that begins with letters and a colon would be taken for another scheme's.
  static constexpr std::string_view kKept =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";
  std::string url;
  for (const char c : path) {
    if (kKept.find(c) != std::string_view::npos)
      url += c;
    else
      url += fmt::format("%{:02X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
  }
  return url;
}

}  // namespace terracast::batch
