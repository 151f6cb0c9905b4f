#include "core/log.h"

#include <spdlog/logger.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <unistd.h>

#include <chrono>

#include "core/error.h"

namespace terracast::core {

namespace {

spdlog::level::level_enum spdlog_level(LogLevel level) {
  switch (level) {
    case LogLevel::Debug:
      return spdlog::level::debug;
    case LogLevel::Info:
      return spdlog::level::info;
    case LogLevel::Warn:
      return spdlog::level::warn;
    case LogLevel::Error:
      return spdlog::level::err;
    case LogLevel::Off:
      break;
  }
  return spdlog::level::off;
}

/// Seconds since the process made its first log.
class ElapsedFlag : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& out) override {
    const double elapsed_s = std::chrono::duration<double>(message.time - start()).count();
    fmt::format_to(std::back_inserter(out), "{:8.2f}", elapsed_s);
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<ElapsedFlag>();
  }
  static spdlog::log_clock::time_point start() {
    static const spdlog::log_clock::time_point first = spdlog::log_clock::now();
    return first;
  }
};

/// "warning: " and the like; info, the common case, has no word.
class LevelFlag : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& out) override {
    std::string_view word;
    if (message.level == spdlog::level::debug) word = "debug: ";
    if (message.level == spdlog::level::warn) word = "warning: ";
    if (message.level == spdlog::level::err) word = "error: ";
    out.append(word.data(), word.data() + word.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<LevelFlag>();
  }
};

}  // namespace

struct Log::Impl {
  std::string stage;
  LogLevel level;
  spdlog::logger logger;

  Impl(std::string stage_name, LogLevel lowest)
      : stage(std::move(stage_name)),
        level(lowest),
        logger(stage, std::make_shared<spdlog::sinks::stderr_color_sink_mt>()) {
    ElapsedFlag::start();
    auto formatter = std::make_unique<spdlog::pattern_formatter>();
    formatter->add_flag<ElapsedFlag>('*').add_flag<LevelFlag>('?');
    // On a terminal a progress line may stand where the cursor is: start over it.
    const bool on_terminal = ::isatty(STDERR_FILENO) == 1;
    formatter->set_pattern(std::string(on_terminal ? "\r\033[K" : "") + "[%*] %n: %^%?%v%$");
    logger.set_formatter(std::move(formatter));
    logger.set_level(spdlog_level(lowest));
    logger.flush_on(spdlog::level::debug);
  }
};

Log::Log(std::string stage, LogLevel level)
    : impl_(std::make_unique<Impl>(std::move(stage), level)) {}
Log::~Log() = default;
Log::Log(Log&&) noexcept = default;

LogLevel Log::level() const { return impl_->level; }

Log Log::for_stage(std::string stage) const { return Log(std::move(stage), impl_->level); }

bool Log::enabled(LogLevel level) const { return level >= impl_->level; }

void Log::write(LogLevel level, const std::string& line) const {
  impl_->logger.log(spdlog_level(level), line);
}

}  // namespace terracast::core
