#include "batch/claims.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <system_error>
#include <thread>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/process_id.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// Records of so many shards share a folder.
constexpr int kShardsPerFolder = 1000;
/// A claim is renewed so many times in a lease: some may fail before it is lost.
constexpr double kRenewalsPerLease = 6.0;
/// A process of another machine that has not been heard of for so long has ended.
constexpr double kForeignLifetime_s = 86400.0;

std::string_view how_name(TryEnd::How how) {
  switch (how) {
    case TryEnd::How::Failed:
      return "failed";
    case TryEnd::How::Released:
      return "released";
    case TryEnd::How::Lost:
      break;
  }
  return "lost";
}

core::Json json_from_end(const TryEnd& end) {
  return core::Json::object()
      .set("how", how_name(end.how))
      .set("error", end.error)
      .set("worker", end.worker);
}

TryEnd end_from_json(const core::Json& json) {
  TryEnd end{.error = json.at("error").string(), .worker = json.at("worker").string()};
  for (const auto how : {TryEnd::How::Failed, TryEnd::How::Released, TryEnd::How::Lost})
    if (json.at("how").string() == how_name(how)) end.how = how;
  return end;
}

/// Sets a file's time of change to the file system's now.
bool touch(const fs::path& file) {
  const timespec now[2] = {{.tv_sec = 0, .tv_nsec = UTIME_NOW},
                           {.tv_sec = 0, .tv_nsec = UTIME_NOW}};
  return ::utimensat(AT_FDCWD, file.c_str(), now, 0) == 0;
}

std::optional<double> changed_s(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return std::nullopt;
  return static_cast<double>(status.st_mtim.tv_sec) +
         1e-9 * static_cast<double>(status.st_mtim.tv_nsec);
}

/// The number, 0 or more, that all of a text is.
std::optional<int> number_in(std::string_view text) {
  int value = 0;
  if (text.starts_with('-')) return std::nullopt;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// A file of the folder of claims: "000012.1" or, of its end, "000012.1.end".
struct TryFile {
  int index = 0;
  int number = 0;
  bool is_end = false;
};
std::optional<TryFile> try_from_name(std::string_view name) {
  constexpr std::string_view kEnd = ".end";
  const bool is_end = name.ends_with(kEnd);
  if (is_end) name.remove_suffix(kEnd.size());
  const auto dot = std::min(name.find('.'), name.size());
  const auto index = number_in(name.substr(0, dot));
  const auto number = number_in(name.substr(std::min(dot + 1, name.size())));
  if (!index || !number) return std::nullopt;
  return TryFile{*index, *number, is_end};
}

/// An error as a record can hold it: it may name files of any bytes, and quote other programs.
std::string text_of_error(std::string_view error) {
  std::string text;
  while (true) {
    const std::size_t end = std::min(error.find('\n'), error.size());
    text += core::printable(error.substr(0, end));
    if (end == error.size()) return text;
    text += '\n';
    error.remove_prefix(end + 1);
  }
}

}  // namespace

struct Claims::Impl {
  fs::path folder;
  ClaimOptions options;
  std::string worker = core::this_process();
  fs::path clock;  ///< a file of our own, whose time of change is the file system's now

  std::mutex mutex;
  std::condition_variable wake;
  bool is_ending = false;
  std::set<fs::path> held;  ///< claims to be renewed
  struct Sight {
    double changed_s = 0.0;
    std::chrono::steady_clock::time_point since;
  };
  std::map<fs::path, Sight>
      sights;  ///< others' claims as they were when they were last seen to change
  std::thread renewer;

  Impl(fs::path state_folder, const ClaimOptions& claim_options)
      : folder(std::move(state_folder)), options(claim_options) {
    clock = folder / "clocks" / fmt::format("{}-{}", worker, core::random_name());
    renewer = std::thread([this] { renew(); });
  }
  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      is_ending = true;
    }
    wake.notify_all();
    renewer.join();
    std::error_code ignored;
    fs::remove(clock, ignored);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void renew() {
    const std::chrono::duration<double> period(options.lease_s / kRenewalsPerLease);
    std::unique_lock lock(mutex);
    while (!wake.wait_for(lock, period, [this] { return is_ending; }))
      // One that is gone was taken back with its shard's commit; whoever holds it goes on to the
      // same bytes.
      for (const fs::path& claim : held) touch(claim);
  }

  fs::path done_file(const ShardId& shard) const {
    return folder / "done" / stage_name(shard.stage) /
           fmt::format("{:03}", shard.index / kShardsPerFolder) /
           fmt::format("{:06}.json", shard.index);
  }
  void put_record(const ShardId& shard, core::Json record) const {
    core::add_content_hash(record);
    core::write_new_file(done_file(shard), record.text() + "\n");
  }
  fs::path try_file(const ShardId& shard, int number) const {
    return folder / "claims" / stage_name(shard.stage) /
           fmt::format("{:06}.{}", shard.index, number);
  }
  static fs::path end_file(const fs::path& try_file) { return try_file.string() + ".end"; }

  double now_s() {
    const std::lock_guard lock(mutex);
    std::optional<double> now;
    try {
      if (!touch(clock)) core::write_file(clock, "");
      now = changed_s(clock);
    } catch (const core::Error&) {
      // Who may only read looks at a job all the same.
    }
    const std::chrono::duration<double> machine =
        std::chrono::system_clock::now().time_since_epoch();
    return now.value_or(machine.count());
  }

  /// Who made a try, as its file says; nothing where it is damaged or was taken back.
  struct Holder {
    std::string host, process;
    double lease_s = 0.0;  ///< its own: others may have been started with another
  };
  static std::optional<Holder> holder_of(const fs::path& file) {
    try {
      const core::Json json = core::Json::read(file);
      core::check_content_hash(json);
      return Holder{.host = json.at("host").string(),
                    .process = json.at("process").string(),
                    .lease_s = json.at("lease_s").number()};
    } catch (const core::Error&) {
      return std::nullopt;
    }
  }
  core::Json own_claim() const {
    core::Json json = core::Json::object();
    json.set("host", core::host_name()).set("process", worker).set("lease_s", options.lease_s);
    core::add_content_hash(json);
    return json;
  }
  static std::string worker_of(const fs::path& file) {
    const std::optional<Holder> holder = holder_of(file);
    return holder ? holder->host : "unknown";
  }

  /// Whether a claim has not changed for a lease since we first saw it so. By that a holder is missed
  /// whose clock was ahead when it renewed its claim, on a file system that takes times from machines.
  bool stands_still(const fs::path& file, double changed_s, double lease_s) {
    const auto now = std::chrono::steady_clock::now();
    const std::lock_guard lock(mutex);
    const auto [seen, is_new] = sights.try_emplace(file, Sight{changed_s, now});
    if (seen->second.changed_s != changed_s) seen->second = {changed_s, now};
    return std::chrono::duration<double>(now - seen->second.since).count() > lease_s;
  }

  /// Whether nobody works on a try any more that has not been ended.
  bool is_lost(const fs::path& file) {
    const std::optional<double> renewed_s = changed_s(file);
    if (!renewed_s) return false;  // taken back just now
    const std::optional<Holder> holder = holder_of(file);
    if (holder && core::process_state(holder->process) == core::ProcessState::Ended) return true;
    const double lease_s = holder ? holder->lease_s : options.lease_s;
    return now_s() - *renewed_s > lease_s || stands_still(file, *renewed_s, lease_s);
  }

  /// Whether a process will never be heard of again.
  /// file   that it wrote or touched last
  bool has_ended(const std::string& process, const fs::path& file) {
    const core::ProcessState state = core::process_state(process);
    if (state != core::ProcessState::Elsewhere) return state == core::ProcessState::Ended;
    const std::optional<double> heard_s = changed_s(file);
    return heard_s && now_s() - *heard_s > kForeignLifetime_s;
  }

  static void end_try(const fs::path& file, const TryEnd& end) {
    core::write_new_file(end_file(file), json_from_end(end).text() + "\n");
  }

  static TryEnd lost_end(const fs::path& file) {
    return {.how = TryEnd::How::Lost, .error = {}, .worker = worker_of(file)};
  }

  /// A shard's tries, also those behind a number that is missing.
  std::vector<fs::path> try_files(const ShardId& shard) const {
    std::vector<fs::path> files;
    std::error_code missing;
    for (const fs::directory_entry& entry :
         fs::directory_iterator(folder / "claims" / stage_name(shard.stage), missing)) {
      const auto found = try_from_name(entry.path().filename().string());
      if (found && !found->is_end && found->index == shard.index) files.push_back(entry.path());
    }
    return files;
  }

  static void remove_try(const fs::path& file) {
    std::error_code ignored;
    fs::remove(file, ignored);
    fs::remove(end_file(file), ignored);
  }

  /// Of a shard that is done, this process's earlier tries. Others' stay until somebody has cleared up
  /// behind them.
  void forget_own_tries(const ShardId& shard) const {
    std::error_code ignored;
    for (int number = 1; fs::exists(try_file(shard, number), ignored); ++number)
      if (const auto holder = holder_of(try_file(shard, number));
          holder && holder->process == worker)
        remove_try(try_file(shard, number));
  }

  struct Tries {
    int count = 0;
    int num_counted = 0;  ///< failed or lost
    bool is_held = false;
  };
  /// Ends the last try where it is lost.
  Tries tries(const ShardId& shard) {
    Tries all;
    std::error_code ignored;
    for (fs::path file; fs::exists(file = try_file(shard, all.count + 1), ignored);) {
      ++all.count;
      const std::optional<TryEnd> end = end_of(file);
      if (!end && !is_lost(file)) {
        all.is_held = true;
        continue;
      }
      if (!end) end_try(file, lost_end(file));
      if (!end || end->how != TryEnd::How::Released) ++all.num_counted;
    }
    return all;
  }

  static std::optional<TryEnd> end_of(const fs::path& file) {
    std::error_code ignored;
    if (!fs::exists(end_file(file), ignored)) return std::nullopt;
    try {
      return end_from_json(core::Json::read(end_file(file)));
    } catch (const core::Error&) {
      return TryEnd{.how = TryEnd::How::Lost, .error = "its record cannot be read", .worker = {}};
    }
  }
};

struct Claim::Impl {
  Claims::Impl* claims;
  ShardId shard;
  fs::path file;
  bool is_ended = false;

  void hold() {
    const std::lock_guard lock(claims->mutex);
    claims->held.insert(file);
  }
  void let_go() {
    is_ended = true;
    const std::lock_guard lock(claims->mutex);
    claims->held.erase(file);
  }
  void end(TryEnd::How how, const std::string& error) {
    if (is_ended) return;
    let_go();
    std::error_code ignored;
    if (!fs::exists(file, ignored)) return;  // an end without its try would end another's
    Claims::Impl::end_try(file, {.how = how,
                                 .error = text_of_error(error),
                                 .worker = core::host_name() + " " + claims->worker});
  }
};

Claim::Claim(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Claim::Claim(Claim&&) noexcept = default;
Claim& Claim::operator=(Claim&&) noexcept = default;
Claim::~Claim() {
  if (!impl_) return;
  try {
    release();
  } catch (const core::Error&) {
    // Its process ends or its lease runs out: then it is another's all the same.
  }
}

ShardId Claim::shard() const { return impl_->shard; }

void Claim::commit(const core::Json& record) {
  impl_->claims->put_record(impl_->shard, record);
  impl_->let_go();
  Claims::Impl::remove_try(impl_->file);
  impl_->claims->forget_own_tries(impl_->shard);
}

void Claim::fail(const std::string& error) { impl_->end(TryEnd::How::Failed, error); }
void Claim::release() { impl_->end(TryEnd::How::Released, ""); }

Claims::Claims(fs::path folder, const ClaimOptions& options)
    : impl_(std::make_unique<Impl>(std::move(folder), options)) {}
Claims::~Claims() = default;

bool Claims::is_done(const ShardId& shard) const {
  std::error_code ignored;
  return fs::exists(impl_->done_file(shard), ignored);
}

Claims::Standing Claims::standing(const ShardId& shard) const {
  if (is_done(shard)) return Standing::Done;
  const Impl::Tries tries = impl_->tries(shard);
  if (tries.is_held) return Standing::Held;
  return tries.num_counted >= impl_->options.max_tries ? Standing::Poisoned : Standing::Free;
}

std::variant<Claim, Claims::Standing> Claims::claim(const ShardId& shard, bool is_retry) {
  if (is_done(shard)) return Standing::Done;
  const Impl::Tries tries = impl_->tries(shard);
  if (tries.is_held) return Standing::Held;
  if (!is_retry && tries.num_counted >= impl_->options.max_tries) return Standing::Poisoned;
  auto claim = std::make_unique<Claim::Impl>(Claim::Impl{
      .claims = impl_.get(), .shard = shard, .file = impl_->try_file(shard, tries.count + 1)});
  if (!core::write_new_file(claim->file, impl_->own_claim().text() + "\n")) return Standing::Held;
  claim->hold();
  // Its last holder may have committed it between the first look and the claim.
  if (is_done(shard)) {
    claim->let_go();
    Impl::remove_try(claim->file);
    return Standing::Done;
  }
  return Claim(std::move(claim));
}

std::vector<int> Claims::done(Stage stage) const {
  std::vector<int> indices;
  std::error_code missing;
  const fs::path folder = impl_->folder / "done" / stage_name(stage);
  for (const fs::directory_entry& part : fs::directory_iterator(folder, missing)) {
    std::error_code gone;
    for (const fs::directory_entry& entry : fs::directory_iterator(part.path(), gone))
      if (entry.path().extension() == ".json")
        if (const auto index = number_in(entry.path().stem().string())) indices.push_back(*index);
  }
  std::sort(indices.begin(), indices.end());
  return indices;
}

fs::path Claims::record_file(const ShardId& shard) const { return impl_->done_file(shard); }

core::Json Claims::record(const ShardId& shard) const {
  const fs::path file = impl_->done_file(shard);
  return core::with_context(
      [&] {
        core::Json record = core::Json::read(file);
        core::check_content_hash(record);
        return record;
      },
      fmt::format("reading {}; `terracast batch verify --repair` has the shard done again",
                  file.string()));
}

void Claims::set_done(const ShardId& shard, const core::Json& record) {
  impl_->put_record(shard, record);
}

void Claims::reopen(const ShardId& shard) {
  std::error_code error;
  fs::remove(impl_->done_file(shard), error);
  if (error)
    fail(ErrorKind::Io, "{}: cannot be removed: {}", impl_->done_file(shard).string(),
         error.message());
  for (const fs::path& file : impl_->try_files(shard)) {
    std::optional<TryEnd> end = Impl::end_of(file);
    if (!end && impl_->is_lost(file)) end.emplace(Impl::lost_end(file));
    if (!end || end->how == TryEnd::How::Released) continue;
    end->how = TryEnd::How::Released;
    core::write_file(Impl::end_file(file), json_from_end(*end).text() + "\n");
  }
}

void Claims::clear_up(const std::function<void(const ShardId&)>& clear) {
  core::remove_temporaries(impl_->folder / "claims");
  core::remove_temporaries(impl_->folder / "clocks");
  std::error_code ignored;
  for (const Stage stage : kStages)
    for (const fs::directory_entry& entry :
         fs::directory_iterator(impl_->folder / "claims" / stage_name(stage), ignored)) {
      const auto found = try_from_name(entry.path().filename().string());
      if (!found) continue;
      const ShardId shard{stage, found->index};
      const fs::path file = impl_->try_file(shard, found->number);
      if (found->is_end && fs::exists(file, ignored)) continue;
      if (found->is_end) Impl::remove_try(file);  // or it would end the next try of that number
      if (found->is_end) continue;
      const std::optional<Impl::Holder> holder = Impl::holder_of(file);
      // Of a damaged one nobody can tell whose it was.
      if (holder ? !impl_->has_ended(holder->process, file) : !impl_->is_lost(file)) continue;
      clear(shard);
      core::remove_temporaries(impl_->done_file(shard).parent_path());
      if (is_done(shard)) Impl::remove_try(file);
    }
  for (const fs::directory_entry& entry :
       fs::directory_iterator(impl_->folder / "clocks", ignored)) {
    const std::string name = entry.path().filename().string();
    if (impl_->has_ended(name.substr(0, std::min(name.rfind('-'), name.size())), entry.path()))
      fs::remove(entry.path(), ignored);
  }
}

std::string Claims::Tried::last_error() const {
  for (auto end = ends.rbegin(); end != ends.rend(); ++end) {
    if (end->how == TryEnd::How::Lost) return "its process ended without a word";
    if (end->how == TryEnd::How::Failed) return end->error.substr(0, end->error.find('\n'));
  }
  return "";
}

std::vector<Claims::Tried> Claims::tried() const {
  std::vector<Tried> all;
  for (const Stage stage : kStages) {
    std::map<int, std::map<int, fs::path>> tries;
    std::error_code missing;
    for (const fs::directory_entry& entry :
         fs::directory_iterator(impl_->folder / "claims" / stage_name(stage), missing)) {
      const auto found = try_from_name(entry.path().filename().string());
      if (found && !found->is_end) tries[found->index][found->number] = entry.path();
    }
    for (const auto& [index, files] : tries) {
      Tried tried{.shard = {stage, index}, .ends = {}, .holder = {}};
      if (is_done(tried.shard)) continue;
      for (const auto& [number, file] : files) {
        if (const auto end = Impl::end_of(file)) {
          tried.ends.push_back(*end);
        } else if (impl_->is_lost(file)) {
          tried.ends.push_back(Impl::lost_end(file));
        } else {
          tried.holder = Impl::worker_of(file);
        }
      }
      const auto num_counted =
          std::count_if(tried.ends.begin(), tried.ends.end(),
                        [](const TryEnd& end) { return end.how != TryEnd::How::Released; });
      tried.is_poisoned = tried.holder.empty() && num_counted >= impl_->options.max_tries;
      all.push_back(std::move(tried));
    }
  }
  return all;
}

}  // namespace terracast::batch
