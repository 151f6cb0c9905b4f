#include "validate/colmap/work_folder.h"

#include <fmt/format.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"

namespace terracast::validate {

namespace fs = std::filesystem;

namespace {

constexpr const char* kMadeFrom = "made_from.txt";

/// Whether a folder was made from what has this hash.
bool is_made_from(const fs::path& folder, const std::string& hash) {
  std::error_code ignored;
  if (!fs::is_regular_file(folder / kMadeFrom, ignored)) return false;
  constexpr std::size_t kMostBytes = 4096;
  return core::read_text_file(folder / kMadeFrom, kMostBytes) == hash;
}

/// Runs an operation of the file system; what it cannot do is an error of ours.
template <class Operation>
void attempt(const fs::path& path, const Operation& operation) {
  std::error_code error;
  operation(error);
  if (error) core::fail(core::ErrorKind::Io, "{}: {}", path.string(), error.message());
}

void remove_folder(const fs::path& folder) {
  attempt(folder, [&](std::error_code& error) { fs::remove_all(folder, error); });
}

void rename_folder(const fs::path& from, const fs::path& to) {
  remove_folder(to);
  attempt(to, [&](std::error_code& error) { fs::rename(from, to, error); });
}

}  // namespace

WorkFolder::WorkFolder(fs::path folder) : folder_(std::move(folder)) { core::make_folder(folder_); }

fs::path WorkFolder::made(const std::string& name, std::string_view key,
                          const std::function<void(const fs::path&)>& make) const {
  fs::path finished = folder_ / name;
  const std::string hash = core::content_hash(key);
  if (is_made_from(finished, hash)) return finished;
  const fs::path partial = folder_ / (name + ".partial");
  remove_folder(partial);
  core::make_folder(partial);
  make(partial);
  core::write_file(partial / kMadeFrom, hash);
  rename_folder(partial, finished);
  return finished;
}

fs::path WorkFolder::grown(const std::string& name, const std::vector<Step>& steps) const {
  const auto folder_of = [&](std::size_t step) {
    return folder_ / fmt::format("{}_{:03}", name, step);
  };
  std::vector<std::string> keys;
  keys.reserve(steps.size());
  for (const Step& step : steps)
    keys.push_back(core::content_hash((keys.empty() ? "" : keys.back()) + step.key));
  std::size_t num_done = steps.size();
  while (num_done > 0 &&
         !is_made_from(folder_of(num_done - 1), core::content_hash(keys[num_done - 1])))
    --num_done;
  for (std::size_t i = num_done; i < steps.size(); ++i) {
    made(folder_of(i).filename().string(), keys[i], [&](const fs::path& folder) {
      if (i > 0)
        attempt(folder, [&](std::error_code& error) {
          fs::copy(folder_of(i - 1), folder,
                   fs::copy_options::recursive | fs::copy_options::overwrite_existing, error);
        });
      steps[i].grow(folder);
    });
    if (i > 0) remove_folder(folder_of(i - 1));
  }
  // Of a longer chain that was grown here once, or of one that was cut off at this very place.
  fs::path newest = folder_of(steps.size() - 1);
  std::vector<fs::path> older;
  for (const auto& entry : fs::directory_iterator(folder_)) {
    const std::string other = entry.path().filename().string();
    if (other.starts_with(name + "_") &&
        other.find_first_not_of("0123456789", name.size() + 1) == std::string::npos &&
        entry.path() != newest)
      older.push_back(entry.path());
  }
  for (const fs::path& folder : older) remove_folder(folder);
  return newest;
}

}  // namespace terracast::validate
