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

/// throws Io: there is no such folder, or it cannot be listed
std::vector<std::string> files_below(const fs::path& folder) {
  std::vector<std::string> files;
  try {
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (!entry.is_directory()) files.push_back(entry.path().lexically_relative(folder).string());
  } catch (const fs::filesystem_error& error) {
    fail(ErrorKind::Io, "{}: cannot be listed: {}", folder.string(), error.code().message());
  }
  std::sort(files.begin(), files.end());
  return files;
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
  std::vector<core::FileChecksum> checksums;
  const auto take = [&](std::string_view line) {
    const std::string_view digits = line.substr(0, std::min(kDigits, line.size()));
    if (line.size() < kDigits + 3 || line.substr(kDigits, 2) != "  " ||
        digits.find_first_not_of("0123456789abcdef") != std::string_view::npos)
      fail(ErrorKind::Input, "{}: line {} is no checksum: is the file damaged?", file.string(),
           checksums.size() + 1);
    checksums.push_back({std::string(line.substr(kDigits + 2)), std::string(digits)});
  };
  // By blocks: SHA256SUMS of ten million frames has 12 GB.
  std::string rest;
  core::read_file_blocks(file, [&](std::span<const std::byte> block) {
    rest.append(reinterpret_cast<const char*>(block.data()), block.size());
    std::size_t begin = 0;
    for (std::size_t end; (end = rest.find('\n', begin)) != std::string::npos; begin = end + 1)
      take(std::string_view(rest).substr(begin, end - begin));
    rest.erase(0, begin);
  });
  if (!rest.empty()) take(rest);
  return checksums;
}

CheckedFolder checked_folder(const Plan& plan, const JobFolder& folder, const ShardId& shard,
                             const Piece& piece) {
  const PlannedRun& run = plan.runs[static_cast<std::size_t>(piece.run)];
  const std::string& format = run.formats[static_cast<std::size_t>(piece.format)].name;
  if (shard.stage == Stage::Validate)
    return {.shard = shard,
            .root = folder.report(run, format),
            .folder = {},
            .checksums = folder.report_checksums(run, format)};
  return {.shard = shard,
          .root = folder.dataset(),
          .folder = JobFolder::exported(run, format),
          .checksums = folder.checksums(run, format)};
}

std::vector<DamagedFile> find_damaged(const std::vector<CheckedFolder>& folders,
                                      const core::Context& context,
                                      std::vector<core::FileChecksum>& checksums) {
  std::vector<DamagedFile> damaged;
  struct File {
    ShardId shard;
    fs::path path;
  };
  std::vector<File> files;  // of the checksums
  checksums.clear();
  for (const CheckedFolder& checked : folders) {
    const fs::path folder = checked.root / checked.folder;
    std::vector<core::FileChecksum> known;
    try {
      known = read_checksums(checked.checksums);
    } catch (const core::Error& error) {
      if (error.kind() == ErrorKind::Interrupted) throw;
      damaged.push_back(
          {checked.shard, folder.string(), fmt::format("has no checksums ({})", error.message())});
      continue;
    }
    std::set<fs::path> others;
    std::error_code missing;
    if (fs::is_directory(folder, missing))
      for (const std::string& file : files_below(folder)) others.insert(folder / file);
    for (core::FileChecksum& checksum : known) {
      files.push_back({checked.shard, checked.root / checksum.path});
      others.erase(files.back().path);
      checksums.push_back(std::move(checksum));
    }
    for (const fs::path& file : others)
      damaged.push_back(
          {checked.shard, file.string(),
           checked.shard.stage == Stage::Export ? "was not exported" : "was not written"});
  }
  core::Progress progress(context, "files", static_cast<std::int64_t>(checksums.size()));
  std::mutex mutex;
  core::parallel_for(static_cast<std::int64_t>(checksums.size()), [&](std::int64_t k) {
    const auto i = static_cast<std::size_t>(k);
    const std::string what = damage_of(files[i].path, checksums[i].sha256);
    if (!what.empty()) {
      const std::lock_guard lock(mutex);
      damaged.push_back({files[i].shard, files[i].path.string(), what});
    }
    progress.advance();
  });
  std::sort(damaged.begin(), damaged.end(),
            [](const DamagedFile& a, const DamagedFile& b) { return a.file < b.file; });
  return damaged;
}

std::string damage_of(const fs::path& file, const std::string& sha256) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return "is missing";
  try {
    return core::sha256_of_file(file) == sha256 ? "" : "has changed since it was written";
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Interrupted) throw;
    return error.message();
  }
}

std::string damage_message(const std::vector<DamagedFile>& damaged, const JobFolder& folder) {
  return fmt::format(
      "{} {}; {} files in all are not as they were made; `terracast batch verify {} --repair` has "
      "them made again",
      damaged.front().file, damaged.front().what, damaged.size(), folder.root.string());
}

}  // namespace terracast::batch
