#include "tests/support/listed_files.h"

#include <map>
#include <string>

#include "core/hash.h"
#include "core/json.h"

namespace terracast::test {

namespace fs = std::filesystem;
using core::Json;

void list_files_again(const fs::path& folder) {
  Json json = Json::read(folder / "dataset.json");
  std::map<std::string, std::string> found;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string path = entry.path().lexically_relative(folder).generic_string();
    if (entry.is_regular_file() && path != "dataset.json")
      found[path] = core::content_hash_of_file(entry.path());
  }
  Json files = Json::object();
  for (const auto& [path, hash] : found)
    files.set(path, Json::object()
                        .set("bytes", static_cast<std::uint64_t>(fs::file_size(folder / path)))
                        .set("xxh3_128", hash));
  json.set("files", files);
  json.write(folder / "dataset.json");
}

}  // namespace terracast::test
