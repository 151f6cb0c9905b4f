#include <fmt/format.h>

#include <atomic>

#include "core/hash.h"
#include "core/parallel.h"
#include "validate/checks/checker.h"

/// Whether the folder holds exactly the files that dataset.json lists, byte for byte. Unreadable or
/// missing content joins in the same result, as the findings of the readers.
namespace terracast::validate {

namespace {

class StructureChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset& dataset, const Sequence&) override {
    // Each kind has its own, so that many of one hide none of another.
    Findings missing, changed, extra;
    std::vector<std::pair<std::string, FileRecord>> listed(dataset.files.begin(),
                                                           dataset.files.end());
    std::atomic<std::uint64_t> num_bytes{0};
    core::parallel_for(static_cast<std::int64_t>(listed.size()), [&](std::int64_t i) {
      const std::string& path = listed[static_cast<std::size_t>(i)].first;
      const FileRecord& record = listed[static_cast<std::size_t>(i)].second;
      changed.attempt(path, [&] {
        const std::filesystem::path file = dataset.root / path;
        std::error_code error;
        const std::uintmax_t size = std::filesystem::file_size(file, error);
        if (error) {
          missing.add(path, "missing");
        } else if (size != record.num_bytes) {
          changed.add(path,
                      fmt::format("{} bytes where dataset.json says {}", size, record.num_bytes));
        } else if (core::content_hash_of_file(file) != record.hash) {
          changed.add(path, "its content is not what dataset.json says (hash)");
        }
        num_bytes += error ? 0 : size;
      });
    });
    std::error_code error;
    std::filesystem::recursive_directory_iterator entry(dataset.root, error);
    for (const std::filesystem::recursive_directory_iterator end; !error && entry != end;
         entry.increment(error)) {
      if (entry->is_directory(error)) continue;
      const std::string path = entry->path().lexically_relative(dataset.root).generic_string();
      if (path != "dataset.json" && !dataset.files.contains(path))
        extra.add(path, "not listed in dataset.json");
    }
    CheckResult result;
    result.name = "structure";
    const std::int64_t count = missing.count() + changed.count() + extra.count();
    result.value = static_cast<double>(count);
    result.bound = 0.0;
    result.unit = "findings";
    result.ok = count == 0;
    std::vector<std::string> lines;
    for (const Findings* findings : {&missing, &changed, &extra})
      for (std::string& line : findings->lines()) lines.push_back(std::move(line));
    result.worst = fmt::format("{}", fmt::join(lines, "\n"));
    result.summary = fmt::format(
        "{} files, {:.1f} MB: each is there with its size and hash, and none beside them; every "
        "image, array, pose row and point was read.",
        listed.size(), static_cast<double>(num_bytes) / 1e6);
    result.reason =
        "A file that is missing, damaged or too many shifts what readers pair by number or place "
        "in a list.";
    result.detects =
        "one flipped bit, one missing, extra or truncated file, one missing pose row, a wrong "
        "image size";
    return {result};
  }
};

}  // namespace

std::unique_ptr<Checker> make_structure_check(const ValidateOptions&) {
  return std::make_unique<StructureChecker>();
}

}  // namespace terracast::validate
