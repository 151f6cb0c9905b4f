#include "tests/capture/sequence_support.h"

#include "core/atomic_file.h"
#include "core/hash.h"

namespace terracast::test {

namespace fs = std::filesystem;

std::map<std::string, std::string> hashes(const fs::path& folder) {
  std::map<std::string, std::string> result;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      result[fs::relative(entry.path(), folder).string()] =
          core::content_hash_of_file(entry.path());
  return result;
}

void replace_in(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = core::read_text_file(file);
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  core::write_file(file, text.replace(at, from.size(), to));
}

}  // namespace terracast::test
