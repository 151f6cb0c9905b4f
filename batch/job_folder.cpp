#include "batch/job_folder.h"

#include <fcntl.h>
#include <stdio.h>

#include <cerrno>
#include <chrono>
#include <system_error>

#include "core/atomic_file.h"
#include "core/process_id.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// An attempt of another machine may be at work for as long as something is written in it.
constexpr std::chrono::hours kForeignLifetime{24};
/// A twin may put its own in place between our two renames; it does so once.
constexpr int kMaxRenames = 8;

}  // namespace

fs::path JobFolder::state() const { return root / "state" / fmt::format("{:04}", revision); }

Attempt::Attempt(const JobFolder& job)
    : folder_(job.attempts() / fmt::format("{}-{}", core::this_process(), core::random_name())) {
  core::make_folder(folder_);
}

Attempt::~Attempt() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

void Attempt::place(const fs::path& made, const fs::path& final_place) {
  core::make_folder(final_place.parent_path());
  std::error_code error;
  for (int i = 0; i < kMaxRenames; ++i) {
    fs::rename(made, final_place, error);
    if (!error) return;
    // A folder that is not empty is in the way.
    if (::renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, final_place.c_str(), RENAME_EXCHANGE) == 0)
      return;
    std::error_code gone;
    fs::rename(final_place, new_name(), gone);
  }
  fail(ErrorKind::Io, "{}: cannot be put in place: {}", final_place.string(), error.message());
}

void Attempt::place_text(std::string_view text, const fs::path& final_place) {
  const fs::path file = new_name();
  core::write_file(file, text);
  place(file, final_place);
}

void Attempt::take_away(const fs::path& place) {
  std::error_code error;
  fs::rename(place, new_name(), error);
  if (error && error != std::errc::no_such_file_or_directory)
    fail(ErrorKind::Io, "{}: cannot be taken away: {}", place.string(), error.message());
}

fs::path Attempt::new_name() { return folder_ / fmt::format("other-{}", num_names_++); }

bool tells_of(const core::Error& error, const fs::path& folder) {
  const bool is_of_files = error.kind() == ErrorKind::Input || error.kind() == ErrorKind::Io;
  return is_of_files &&
         std::string_view(error.what()).find(folder.string()) != std::string_view::npos;
}

namespace {

/// When something was last made in a folder or below it: of one that is written to, a moment ago.
fs::file_time_type last_change(const fs::path& folder) {
  std::error_code gone;
  fs::file_time_type last = fs::last_write_time(folder, gone);
  for (fs::recursive_directory_iterator entry(folder, gone); !gone && entry != end(entry);
       entry.increment(gone)) {
    std::error_code gone_too;
    const auto changed = entry->last_write_time(gone_too);
    if (!gone_too) last = std::max(last, changed);
  }
  return last;
}

}  // namespace

void remove_ended_attempts(const JobFolder& job) {
  // Clocks of machines differ; a folder that is made now has the file system's time.
  const auto now = [&job] {
    const Attempt made_now(job);
    return fs::last_write_time(made_now.folder());
  };
  std::error_code missing;
  for (const fs::directory_entry& entry : fs::directory_iterator(job.attempts(), missing)) {
    const std::string name = entry.path().filename().string();
    const core::ProcessState state = core::process_state(name.substr(0, name.rfind('-')));
    if (state == core::ProcessState::Lives) continue;
    std::error_code ignored;
    if (state == core::ProcessState::Elsewhere &&
        now() - last_change(entry.path()) < kForeignLifetime)
      continue;
    fs::remove_all(entry.path(), ignored);
  }
}

}  // namespace terracast::batch
