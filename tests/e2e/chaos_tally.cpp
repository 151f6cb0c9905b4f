#include "tests/e2e/chaos_tally.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

namespace terracast::test {

namespace fs = std::filesystem;

std::string general(std::string line) {
  std::string text;
  for (std::size_t i = 0; i < line.size();) {
    if (line[i] == '/') {
      const std::size_t end = line.find_first_of(" :;,)", i);
      const std::string path = line.substr(i, end - i);
      text += "…" + fs::path(path).extension().string();
      i = std::min(end, line.size());
    } else if (std::isdigit(static_cast<unsigned char>(line[i])) != 0) {
      text += '#';
      i = std::min(line.find_first_not_of("0123456789abcdef.", i), line.size());
    } else {
      text += line[i++];
    }
  }
  return text;
}

std::string error_line(const std::string& output) {
  for (const char* mark : {"error: ", "failed: ", "given up", " not as they were made"}) {
    const std::size_t at = output.find(mark);
    if (at == std::string::npos) continue;
    const std::size_t begin = output.rfind('\n', at) + 1;
    return output.substr(begin, output.find('\n', at) - begin);
  }
  return output.substr(0, output.find('\n'));
}

}  // namespace terracast::test
