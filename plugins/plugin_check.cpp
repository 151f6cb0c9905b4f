#include "plugins/plugin_check.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <system_error>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/registry.h"
#include "core/stop.h"
#include "core/toml_reader.h"
#include "plugins/blame.h"
#include "plugins/law_ground.h"
#include "rigs/rig.h"

namespace terracast::plugins {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// A folder that goes with its object, unless it was given.
class WorkFolder {
 public:
  explicit WorkFolder(const fs::path& given) : path_(given), is_own_(given.empty()) {
    if (is_own_) {
      std::string name = (fs::temp_directory_path() / "terracast-plugin-XXXXXX").string();
      if (mkdtemp(name.data()) == nullptr)
        fail(ErrorKind::Io, "{}: cannot be made: {}", name, std::generic_category().message(errno));
      path_ = name;
    } else {
      core::make_folder(path_);
      if (!fs::is_empty(path_))
        fail(ErrorKind::Usage, "--folder {}: is not empty; name a new one", path_.string());
    }
  }
  ~WorkFolder() {
    std::error_code ignored;
    if (is_own_) fs::remove_all(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  bool is_own_;
};

/// How a child process told of laws and ended.
struct Heard {
  std::vector<LawTried> laws;
  std::string ended;
  std::string wrong_keys;  ///< what is wrong with the keys that were given
  bool is_done = false;
};

// A record is a letter, text, and a zero byte: L law begun, B what is broken, E what was thrown, K what is wrong with the
// keys that were given, D done.
void send(int pipe, char what, const std::string& text) {
  std::string record = what + text;
  std::erase(record, '\0');
  record += '\0';
  for (std::size_t at = 0; at < record.size();) {
    const ssize_t sent = write(pipe, record.data() + at, record.size() - at);
    if (sent <= 0) _exit(1);
    at += static_cast<std::size_t>(sent);
  }
}

/// Each line printable; further lines are set in.
std::string printable_lines(std::string_view text) {
  std::string lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines += (lines.empty() ? "" : "\n            ") + core::printable(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

void hear(std::string& text, Heard& heard) {
  for (std::size_t end = text.find('\0'); end != std::string::npos; end = text.find('\0')) {
    const std::string record = printable_lines(text.substr(1, end - 1));
    if (text.front() == 'L') heard.laws.push_back({.law = record, .broken = {}});
    if (text.front() == 'B' && !heard.laws.empty()) heard.laws.back().broken = record;
    if (text.front() == 'E') heard.ended = record;
    if (text.front() == 'K') heard.wrong_keys = record;
    if (text.front() == 'D') heard.is_done = true;
    text.erase(0, end + 1);
  }
}

/// The keys that were given for a kind do not fit it.
struct WrongKeys {
  std::string message;
};

/// What the exception that is being handled says.
std::string words_of_exception() {
  const std::string thrower = thrower_of_current_exception();
  const std::string by = thrower.empty() ? "" : ", out of " + thrower;
  try {
    throw;
  } catch (const core::Error& error) {
    return fmt::format("throws: {}", error.what());
  } catch (const std::exception& error) {
    return fmt::format("throws \"{}\"{}, which is no core::Error: end with core::fail",
                       error.what(), by);
  } catch (...) {
    return fmt::format("throws something that is no exception{}: end with core::fail", by);
  }
}

[[noreturn]] void run_child(int pipe, const std::function<void(LawReport&)>& work) {
  try {
    LawReport report([pipe](const LawTried& law) {
      send(pipe, law.broken.empty() ? 'L' : 'B', law.broken.empty() ? law.law : law.broken);
    });
    work(report);
    send(pipe, 'D', "");
  } catch (const WrongKeys& wrong) {
    send(pipe, 'K', wrong.message);
  } catch (...) {
    send(pipe, 'E', words_of_exception());
  }
  // No destructors: what a plug-in left running has its end here.
  _exit(0);
}

/// Reads what a child sends until it ends, or its time is over.
/// returns  whether it ended by itself
bool listen(int pipe, double limit_s, Heard& heard) {
  using Clock = std::chrono::steady_clock;
  const auto until = Clock::now() + std::chrono::duration<double>(limit_s);
  std::string text;
  std::array<char, 4096> bytes;
  while (true) {
    if (core::stop_asked()) return false;
    const auto left_ms =
        std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now()).count();
    if (left_ms <= 0) return false;
    pollfd waited{.fd = pipe, .events = POLLIN, .revents = 0};
    if (poll(&waited, 1, static_cast<int>(std::min<long long>(left_ms, 200))) < 0 && errno != EINTR)
      return false;
    if (waited.revents == 0) continue;
    const ssize_t got = read(pipe, bytes.data(), bytes.size());
    if (got == 0) return true;
    if (got < 0 && errno != EINTR) return false;
    if (got > 0) text.append(bytes.data(), static_cast<std::size_t>(got));
    hear(text, heard);
  }
}

std::string words_of_status(int status) {
  if (WIFSIGNALED(status)) return fmt::format("crashed by SIG{}", sigabbrev_np(WTERMSIG(status)));
  if (WIFEXITED(status) && WEXITSTATUS(status) == core::exit_status(ErrorKind::Internal))
    return "crashed or called exit() (its place on the stack stands above)";
  return fmt::format("ended the process with status {} in the midst of it", WEXITSTATUS(status));
}

/// Waits for the end of a process.
bool ends_within(pid_t child, double limit_s, int& status) {
  constexpr int kStep_ms = 10;
  for (double waited_s = 0.0; waited_s < limit_s; waited_s += 1e-3 * kStep_ms) {
    const pid_t ended = waitpid(child, &status, WNOHANG);
    if (ended == child) return true;
    if (ended < 0 && errno != EINTR) return false;
    poll(nullptr, 0, kStep_ms);
  }
  return false;
}

/// Runs `work` in a process of its own, which ends with this one.
/// throws   Interrupted
Heard in_child(double limit_s, const std::function<void(LawReport&)>& work) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0)
    fail(ErrorKind::Io, "no pipe: {}", std::generic_category().message(errno));
  fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) fail(ErrorKind::Io, "no process: {}", std::generic_category().message(errno));
  if (child == 0) {
    close(ends[0]);
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    name_plugins_in_crashes();
    run_child(ends[1], work);
  }
  close(ends[1]);
  Heard heard;
  const bool has_ended = listen(ends[0], limit_s, heard);
  close(ends[0]);
  // One that has closed the pipe ends at once, or hangs as well.
  int status = 0;
  const bool is_gone = has_ended && ends_within(child, 5.0, status);
  kill(-child, SIGKILL);
  if (!is_gone) {
    kill(child, SIGKILL);
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  }
  core::throw_if_stop_asked();
  if (!is_gone)
    heard.ended = fmt::format("hangs: it was not done after {} s", limit_s);
  else if (heard.ended.empty() && !heard.is_done)
    heard.ended = words_of_status(status);
  return heard;
}

const KindKeys* keys_of(const KindInPlugin& kind, const CheckOptions& options) {
  const auto own = options.keys.find(std::string(kind.name));
  return own == options.keys.end() ? nullptr : &own->second;
}

/// Reads the options of a kind: its defaults, and the keys that were given.
/// key      that names the kind
/// others   keys beside it, as of --set
/// throws   WrongKeys: keys were given, and do not fit
template <class Options>
Options read_options(const KindInPlugin& kind, const std::string& key, const CheckOptions& options,
                     LawReport& report, std::vector<std::string> others = {}) {
  report.begin("its options are read");
  const KindKeys* keys = keys_of(kind, options);
  others.push_back(fmt::format("{}=\"{}\"", key, kind.name));
  try {
    Options read;
    core::TomlDocument::parse(keys == nullptr ? "" : keys->toml,
                              keys == nullptr ? "the kind's keys" : keys->file, others)
        .read(read);
    return read;
  } catch (const core::Error& error) {
    if (keys == nullptr || error.kind() == ErrorKind::Internal) throw;
    throw WrongKeys{error.what()};
  }
}

/// A camera's own keys beside those that every camera has.
void check_camera_keys(const KindInPlugin& kind, LawReport& report) {
  struct Keys {
    rigs::CameraOptions camera;
    void describe(core::SchemaVisitor& visit) { camera.describe(visit); }
  } keys;
  report.begin("its keys have names of their own");
  try {
    core::TomlDocument::parse(fmt::format("model = \"{}\"", kind.name), "the camera's keys")
        .read(keys);
  } catch (const core::Error& error) {
    if (error.kind() != ErrorKind::Config) throw;  // keys without a default are missing
  }
}

/// The laws of one kind, by its type of table.
void try_laws(const KindInPlugin& kind, const CheckOptions& options, const LawGround& ground,
              const fs::path& folder, LawReport& report) {
  if (kind.type == "camera") {
    const auto& info = core::find_registered(geo::camera_models(), "camera model", kind.name);
    check_camera_keys(kind, report);
    try_camera(example_camera(info), report);
    if (keys_of(kind, options) == nullptr) return;
    rigs::RigOptions rig;
    rig.name = "laws";
    rig.cameras.push_back(
        read_options<rigs::CameraOptions>(kind, "model", options, report, {"name=\"camera\""}));
    report.begin("the camera of its keys is read");
    try_camera(rigs::build_cameras({rig}).front().intrinsics, report);
  } else if (kind.type == "sensor") {
    const auto sensor =
        read_options<sensors::SensorOptions>(kind, "kind", options, report, {"name=\"laws\""});
    in_law_scene(ground, [&](const LawScene& scene) { try_sensor(sensor.sensor, scene, report); });
  } else if (kind.type == "medium") {
    const auto medium = read_options<scene::MediumChoice>(kind, "kind", options, report);
    in_law_scene(ground, [&](const LawScene& scene) { try_medium(medium, scene, report); });
  } else if (kind.type == "layer") {
    try_layer(read_options<tiler::LayerOptions>(kind, "kind", options, report), folder, report);
  } else if (kind.type == "exporter") {
    try_exporter(read_options<exporters::ExportOptions>(kind, "format", options, report),
                 ground.captures(), folder, report);
  } else if (kind.type == "check") {
    const auto& info = core::find_registered(validate::checks(), "check", kind.name);
    try_check(info, ground.datasets(), report);
  } else {
    fail(ErrorKind::Internal, "kinds of type {} have no laws", kind.type);
  }
}

}  // namespace

bool KindVerdict::is_kept() const {
  return ended.empty() && !laws.empty() &&
         std::all_of(laws.begin(), laws.end(),
                     [](const LawTried& law) { return law.broken.empty(); });
}

std::vector<KindVerdict> check_plugins(const CheckOptions& options,
                                       const std::function<void(const KindVerdict&)>& told) {
  std::vector<KindInPlugin> kinds;
  for (const KindInPlugin& kind : kinds_in_plugins())
    if (kind.name.starts_with(options.plugin + ".")) kinds.push_back(kind);
  for (const auto& [name, keys] : options.keys) {
    const auto kind = std::find_if(kinds.begin(), kinds.end(),
                                   [&](const KindInPlugin& one) { return one.name == name; });
    if (kind == kinds.end())
      fail(ErrorKind::Config, "plug-in {} has no kind {}; `terracast plugin list` names its kinds",
           options.plugin, name);
    if (kind->type == "check")
      fail(ErrorKind::Config, "{}: checks have no keys; leave --keys out", name);
    core::TomlDocument::parse(keys.toml, keys.file);  // that it is TOML
  }
  const WorkFolder work(options.folder);
  const LawGround ground{work.path() / "ground"};
  if (std::any_of(kinds.begin(), kinds.end(), [](const KindInPlugin& kind) {
        return kind.type != "camera" && kind.type != "layer";
      })) {
    // In a process of its own, since threads that this one started would not live on in its children.
    const Heard made = in_child(600.0, [&](LawReport&) { make_law_ground(ground.folder); });
    if (!made.ended.empty())
      fail(ErrorKind::Io, "{}: the small job that laws are tried on could not be made: {}",
           ground.folder.string(), made.ended);
  }
  std::vector<KindVerdict> verdicts;
  std::string wrong_keys;
  for (const KindInPlugin& kind : kinds) {
    const Heard heard = in_child(options.limit_s, [&](LawReport& report) {
      try_laws(kind, options, ground, work.path() / std::string(kind.name), report);
    });
    if (!heard.wrong_keys.empty()) {
      wrong_keys += fmt::format("{}keys of {}: {}", wrong_keys.empty() ? "" : "\n", kind.name,
                                heard.wrong_keys);
      continue;
    }
    verdicts.push_back({.kind = kind, .laws = heard.laws, .ended = heard.ended});
    told(verdicts.back());
  }
  if (!wrong_keys.empty()) fail(ErrorKind::Config, "{}", wrong_keys);
  return verdicts;
}

}  // namespace terracast::plugins
