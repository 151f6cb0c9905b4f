#include "batch/checksums.h"

#include <algorithm>
#include <mutex>
#include <set>

#include "core/atomic_file.h"
#include "core/parallel.h"
#include "core/progress.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

std::vector<std::string> files_below(const fs::path& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (!entry.is_directory()) files.push_back(entry.path().lexically_relative(folder).string());
  std::sort(files.begin(), files.end());
  return files;
}

/// "" for a file that is what it was.
std::string damage_of(const fs::path& file, const std::string& sha256) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return "is missing";
  try {
    return core::sha256_of_file(file) == sha256 ? "" : "has changed since it was exported";
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Interrupted) throw;
    return error.message();
  }
}

}  // namespace

std::vector<core::FileChecksum> checksums_of(const fs::path& folder, const fs::path& exported) {
  const std::vector<std::string> files = files_below(folder);
  std::vector<core::FileChecksum> checksums(files.size());
  core::parallel_for(static_cast<std::int64_t>(files.size()), [&](std::int64_t i) {
    const std::string& file = files[static_cast<std::size_t>(i)];
    checksums[static_cast<std::size_t>(i)] = {(exported / file).string(),
                                              core::sha256_of_file(folder / file)};
  });
  return checksums;
}

std::vector<core::FileChecksum> read_checksums(const fs::path& file) {
  constexpr std::size_t kDigits = 64;
  const std::string text = core::read_text_file(file);
  std::vector<core::FileChecksum> checksums;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = std::string_view(text).substr(begin, end - begin);
    const std::string_view digits = line.substr(0, std::min(kDigits, line.size()));
    if (line.size() < kDigits + 3 || line.substr(kDigits, 2) != "  " ||
        digits.find_first_not_of("0123456789abcdef") != std::string_view::npos)
      fail(ErrorKind::Input, "{}: line {} is no checksum: is the file damaged?", file.string(),
           checksums.size() + 1);
    checksums.push_back({std::string(line.substr(kDigits + 2)), std::string(digits)});
    begin = end + 1;
  }
  return checksums;
}

std::vector<DamagedFile> find_damaged(const Plan& plan, const JobFolder& folder,
                                      const core::Context& context,
                                      std::vector<core::FileChecksum>& checksums) {
  std::vector<DamagedFile> damaged;
  std::vector<ShardId> shard_of_file;
  checksums.clear();
  for (const Shard& shard : plan.of(Stage::Export)) {
    for (const Piece& piece : shard.pieces) {
      const PlannedRun& run = plan.runs[static_cast<std::size_t>(piece.run)];
      const std::string& format = run.formats[static_cast<std::size_t>(piece.format)].name;
      const fs::path exported = JobFolder::exported(run, format);
      std::vector<core::FileChecksum> known;
      try {
        known = read_checksums(folder.checksums(run, format));
      } catch (const core::Error& error) {
        damaged.push_back({shard.id, exported.string(), error.message()});
        continue;
      }
      std::set<std::string> others;
      std::error_code missing;
      if (fs::is_directory(folder.dataset() / exported, missing))
        for (const std::string& file : files_below(folder.dataset() / exported))
          others.insert((exported / file).string());
      for (core::FileChecksum& checksum : known) {
        others.erase(checksum.path);
        checksums.push_back(std::move(checksum));
        shard_of_file.push_back(shard.id);
      }
      for (const std::string& file : others)
        damaged.push_back({shard.id, file, "was not exported"});
    }
  }
  core::Progress progress(context, "files", static_cast<std::int64_t>(checksums.size()));
  std::mutex mutex;
  core::parallel_for(static_cast<std::int64_t>(checksums.size()), [&](std::int64_t k) {
    const auto i = static_cast<std::size_t>(k);
    const std::string what = damage_of(folder.dataset() / checksums[i].path, checksums[i].sha256);
    if (!what.empty()) {
      const std::lock_guard lock(mutex);
      damaged.push_back({shard_of_file[i], checksums[i].path, what});
    }
    progress.advance();
  });
  std::sort(damaged.begin(), damaged.end(),
            [](const DamagedFile& a, const DamagedFile& b) { return a.path < b.path; });
  return damaged;
}

}  // namespace terracast::batch
