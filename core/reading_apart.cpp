#include "core/reading_apart.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstring>
#include <limits>
#include <mutex>
#include <new>
#include <optional>
#include <system_error>

#include "core/error.h"
#include "core/log.h"
#include "core/printable.h"
#include "core/program.h"
#include "core/stop.h"

namespace terracast::core {

namespace {

namespace fs = std::filesystem;

constexpr const char* kCommand = "--read-apart";
constexpr int kResultDescriptor = 3;
constexpr int kFileDescriptor = 4;
constexpr std::size_t kMostRequestBytes = 100000;

constexpr const char* kWayOut =
    "it is damaged, or made to do harm: have it written anew, or leave it out";

/// The first byte of an answer; behind it stand what the process lacks of its Confinement, and the result, or an error
/// as JSON.
enum class Answer : std::uint8_t { Result = 'r', Error = 'e', OutOfMemory = 'm' };

/// Bits of an answer's second byte.
constexpr std::uint8_t kLacksFilter = 1;
constexpr std::uint8_t kLacksMemoryLimit = 2;

std::uint8_t lacks_of(const Confinement& done) {
  return static_cast<std::uint8_t>((done.has_system_call_filter ? 0 : kLacksFilter) |
                                   (done.has_memory_limit ? 0 : kLacksMemoryLimit));
}

/// Says it once, for all files that this process has read.
void warn_of_lacks(std::uint8_t lacks) {
  if (lacks == 0) return;
  static std::once_flag once;
  std::call_once(once, [&] {
    std::string what;
    if ((lacks & kLacksFilter) != 0)
      what =
          "the filter of system calls (seccomp), which its kernel or its container does not give";
    if ((lacks & kLacksMemoryLimit) != 0)
      what += std::string(what.empty() ? "" : ", and ") + "the limit on memory (RLIMIT_AS)";
    Log("read").warn(
        "files from outside are read in processes of their own that lack {}: one that is made to "
        "do "
        "harm can do more of it; read only files that you trust here",
        what);
  });
}

fs::path own_program() {
  std::error_code error;
  const fs::path own = fs::read_symlink("/proc/self/exe", error);
  if (error)
    fail(ErrorKind::Internal,
         "/proc/self/exe cannot be read ({}), so that terracast_program, which reads files from "
         "outside, is not found; mount /proc",
         error.message());
  return own.parent_path() / "terracast_program";
}

class Pipe {
 public:
  Pipe() {
    if (::pipe2(ends_.data(), O_CLOEXEC) != 0) refuse();
    // Where this process has no input or output of its own, these would be taken for them.
    for (int& end : ends_) {
      if (end > STDERR_FILENO) continue;
      const int higher = ::fcntl(end, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
      if (higher < 0) refuse();
      ::close(end);
      end = higher;
    }
  }
  ~Pipe() {
    close(0);
    close(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  int read_end() const { return ends_[0]; }
  int write_end() const { return ends_[1]; }
  void close_write_end() { close(1); }

 private:
  [[noreturn]] static void refuse() {
    fail(ErrorKind::Io, "a pipe: {}", std::generic_category().message(errno));
  }
  void close(std::size_t end) {
    if (ends_[end] >= 0) ::close(ends_[end]);
    ends_[end] = -1;
  }
  std::array<int, 2> ends_ = {-1, -1};
};

/// All that comes, up to its end; nothing where it is more than may be.
/// throws   Input: it does not end in time
std::optional<std::vector<std::byte>> read_to_end(int descriptor, const std::string& file,
                                                  const ApartOptions& options) {
  constexpr int kLook_ms = 100;
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  std::vector<std::byte> bytes;
  std::vector<std::byte> part(1 << 16);
  for (;;) {
    throw_if_stop_asked();
    if (std::chrono::duration<double>(Clock::now() - begin).count() > options.longest_s)
      fail(ErrorKind::Input, "{}: reading it takes more than {:g} s; {}", file, options.longest_s,
           kWayOut);
    pollfd looked{.fd = descriptor, .events = POLLIN, .revents = 0};
    if (::poll(&looked, 1, kLook_ms) <= 0) continue;
    const ssize_t count = ::read(descriptor, part.data(), part.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(ErrorKind::Io, "a pipe: {}", std::generic_category().message(errno));
    if (count == 0) return bytes;
    if (bytes.size() + static_cast<std::size_t>(count) > options.most_result_bytes)
      return std::nullopt;
    bytes.insert(bytes.end(), part.begin(), part.begin() + count);
  }
}

[[noreturn]] void throw_again(const Json& json) {
  Error error(static_cast<ErrorKind>(json.at("kind").integer()), json.at("message").string());
  for (const std::string& doing : json.at("context").strings()) error.add_context(doing);
  throw error;
}

/// Says why there is no answer.
[[noreturn]] void refuse(const std::string& file, const ProgramEnd& end,
                         const ReadingLimits& limits) {
  constexpr int kNotStarted = 127;
  if (end.kind == ProgramEnd::Kind::Exited && end.status == kNotStarted)
    fail(ErrorKind::Internal, "{}: cannot be started; it belongs beside terracast",
         own_program().string());
  const auto is_killed_by = [&](int signal) {
    return end.kind == ProgramEnd::Kind::Killed && end.status == signal;
  };
  // A terminal and a queue ask all processes of a job alike.
  throw_if_stop_asked();
  if (is_killed_by(SIGXCPU))
    fail(ErrorKind::Input, "{}: reading it takes more than {:g} s of processor time; {}", file,
         limits.cpu_s, kWayOut);
  if (is_killed_by(SIGKILL))
    fail(ErrorKind::Io,
         "{}: the system killed the process that read it, which it does where memory is short; try "
         "again with more",
         file);
  fail(ErrorKind::Input, "{}: the process that read it {}; {}", file, end.text(), kWayOut);
}

void write_all(int descriptor, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::byte*>(data);
  while (size > 0) {
    const ssize_t count = ::write(descriptor, bytes, size);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) ::_exit(exit_status(ErrorKind::Io));  // nobody listens
    bytes += count;
    size -= static_cast<std::size_t>(count);
  }
}

void answer(Answer kind, std::uint8_t lacks, const void* data, std::size_t size) {
  const std::array<std::uint8_t, 2> head = {static_cast<std::uint8_t>(kind), lacks};
  write_all(kResultDescriptor, head.data(), head.size());
  write_all(kResultDescriptor, data, size);
}

void answer_error(std::uint8_t lacks, const Error& error) {
  // Names in files may have bytes that are no text.
  std::vector<std::string> context;
  for (const std::string& doing : error.context()) context.push_back(printable(doing));
  const std::string text = Json::object()
                               .set("kind", static_cast<int>(error.kind()))
                               .set("message", printable(error.message()))
                               .set("context", Json::array_of(context))
                               .text(-1);
  answer(Answer::Error, lacks, text.data(), text.size());
}

}  // namespace

std::vector<std::byte> read_apart(std::string_view kind, const Json& request,
                                  const std::string& file, const ApartOptions& options) {
  const std::string text = request.text(-1);
  TERRACAST_CHECK(text.size() <= kMostRequestBytes, "a request of {} bytes", text.size());
  Pipe pipe;
  std::vector<int> descriptors = {pipe.write_end()};
  if (options.file != nullptr) descriptors.push_back(options.file->descriptor());
  RunningProgram reader(
      own_program(),
      {kCommand, std::string(kind), text, std::to_string(options.limits.memory_bytes),
       fmt::format("{:.0f}", options.limits.cpu_s),
       std::to_string(options.file == nullptr ? 0 : options.limits.file_bytes)},
      {.log_file = "/dev/null", .environment = {}, .descriptors = descriptors});
  pipe.close_write_end();
  std::optional<std::vector<std::byte>> bytes = read_to_end(pipe.read_end(), file, options);
  if (!bytes)
    fail(ErrorKind::Input, "{}: more than {} bytes are made of it; {}", file,
         options.most_result_bytes, kWayOut);
  constexpr double kSoon_s = 10.0;
  const std::optional<ProgramEnd> end = reader.wait(kSoon_s);
  constexpr std::size_t kHead_bytes = 2;
  if (!end || !end->is_success() || bytes->size() < kHead_bytes)
    refuse(file, end.value_or(ProgramEnd{.kind = ProgramEnd::Kind::TimedOut, .status = 0}),
           options.limits);
  const auto first = static_cast<Answer>(bytes->front());
  warn_of_lacks(static_cast<std::uint8_t>((*bytes)[1]));
  bytes->erase(bytes->begin(), bytes->begin() + kHead_bytes);
  if (first == Answer::Result) return std::move(*bytes);
  if (first == Answer::OutOfMemory)
    fail(ErrorKind::Input, "{}: reading it takes more than {:.1f} GiB of memory; {}", file,
         static_cast<double>(options.limits.memory_bytes) / (1 << 30), kWayOut);
  throw_again(Json::parse({reinterpret_cast<const char*>(bytes->data()), bytes->size()},
                          "the answer of " + own_program().string()));
}

std::string path_for_request(const fs::path& path) {
  std::string text;
  for (const char c : path.native()) text += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return text;
}

fs::path path_of_request(const std::string& text) {
  std::string path;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
    unsigned value = 0;
    const auto [end, error] = std::from_chars(&text[i], &text[i] + 2, value, 16);
    if (error != std::errc() || end != &text[i] + 2)
      fail(ErrorKind::Internal, "\"{}\" is no path of a request", text);
    path += static_cast<char>(value);
  }
  return path;
}

void append_to_file(std::span<const std::byte> bytes, const std::string& of) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(kFileDescriptor, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EFBIG)
      fail(ErrorKind::Input, "{}: more is made of it than a temporary file may hold; {}", of,
           kWayOut);
    if (count <= 0)
      fail(ErrorKind::Io,
           "{}: what is made of it cannot be written into the folder for temporary files ({}); "
           "state another as TMPDIR",
           of, std::generic_category().message(errno));
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

bool is_reading_apart(int argc, char** argv) {
  return argc > 1 && std::strcmp(argv[1], kCommand) == 0;
}

int serve_reading(std::span<const ApartReader> readers, int argc, char** argv) {
  constexpr int kWords = 7;
  if (argc != kWords || ::fcntl(kResultDescriptor, F_GETFD) < 0) {
    fmt::print(stderr, "error: {} is for terracast itself\n", kCommand);
    return exit_status(ErrorKind::Usage);
  }
  // Who started it is asked to stop, and ends it.
  ::signal(SIGINT, SIG_IGN);
  ::signal(SIGTERM, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);  // a write says so
  std::uint8_t lacks = 0;
  try {
    const ReadingLimits limits{.memory_bytes = std::stoull(argv[4]),
                               .cpu_s = std::stod(argv[5]),
                               .file_bytes = std::stoull(argv[6])};
    ::close_range(limits.file_bytes > 0 ? kFileDescriptor + 1 : kFileDescriptor, ~0U, 0);
    lacks = lacks_of(confine_this_process(limits));
    for (const ApartReader& reader : readers) {
      if (reader.kind != argv[2]) continue;
      const std::vector<std::byte> result = reader.read(Json::parse(argv[3], "a request"));
      answer(Answer::Result, lacks, result.data(), result.size());
      return 0;
    }
    fail(ErrorKind::Internal, "terracast_program reads no {}; it is of another version", argv[2]);
  } catch (const Error& error) {
    answer_error(lacks, error);
  } catch (const std::bad_alloc&) {
    answer(Answer::OutOfMemory, lacks, nullptr, 0);
  } catch (const std::exception& error) {
    answer_error(lacks, Error(ErrorKind::Internal, error.what()));
  }
  return 0;
}

}  // namespace terracast::core
