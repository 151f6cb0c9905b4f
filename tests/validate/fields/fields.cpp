#include "tests/validate/fields/fields.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <span>
#include <stdexcept>

#include "core/atomic_file.h"
#include "tests/validate/analytic_writer.h"
#include "validate/npy.h"

namespace terracast::test {

namespace fs = std::filesystem;

namespace {

std::vector<NamedChange> fields_in(const std::string& path, const std::string& bytes) {
  const fs::path file(path);
  const std::string ending = file.extension().string();
  if (ending == ".json") return json_fields(bytes);
  if (ending == ".csv") return csv_fields(bytes);
  if (ending == ".txt") return word_fields(bytes);
  if (ending == ".npy") return npy_fields(bytes);
  if (ending == ".npz") return npz_fields(bytes);
  if (ending == ".png") return png_fields(bytes);
  if (ending == ".bin") return colmap_fields(file.filename().string(), bytes);
  if (ending == ".db") return database_fields(bytes);
  throw std::runtime_error("no syntax is known of " + path);
}

std::string type_of(const validate::NpyArray& array) {
  return array.kind == 'f' ? "<f4" : array.kind == 'b' ? "|b1" : "|u1";
}

}  // namespace

// Each array is changed as an npy of its own, and the archive written anew.
std::vector<NamedChange> npz_fields(const std::string& bytes) {
  const auto arrays = [](const std::string& all) {
    std::map<std::string, std::string> files;
    for (const auto& [name, array] : validate::parse_npz(std::as_bytes(std::span(all)), "npz"))
      files[name + ".npy"] =
          npy_bytes(type_of(array), array.shape, array.bytes.data(), array.bytes.size());
    return files;
  };
  std::vector<NamedChange> fields;
  for (const auto& [name, array] : arrays(bytes))
    for (const auto& [channel, change] : npy_fields(array))
      fields.emplace_back(name + " " + channel, [=](const std::string& all, const Amount& amount) {
        std::map<std::string, std::string> files = arrays(all);
        files[name] = change(files[name], amount);
        const fs::path file = fs::temp_directory_path() / fmt::format("fields-{}.npz", ::getpid());
        write_npz(file, files);
        std::string changed = core::read_text_file(file);
        fs::remove(file);
        return changed;
      });
  return fields;
}

std::vector<Field> fields_of(const fs::path& dataset) {
  std::map<std::pair<std::string, std::string>, Field> fields;
  for (const auto& entry : fs::recursive_directory_iterator(dataset)) {
    if (!entry.is_regular_file()) continue;
    const std::string path = entry.path().lexically_relative(dataset).generic_string();
    for (auto& [name, change] : fields_in(path, core::read_text_file(entry.path()))) {
      Field& field = fields[{kind_of(path), name}];
      field.kind = kind_of(path);
      field.name = name;
      field.places.push_back({path, std::move(change)});
    }
  }
  std::vector<Field> all;
  for (auto& [key, field] : fields) {
    std::sort(field.places.begin(), field.places.end(),
              [](const FieldPlace& a, const FieldPlace& b) { return a.file < b.file; });
    all.push_back(std::move(field));
  }
  return all;
}

}  // namespace terracast::test
