#include "core/stop.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstring>

#include "core/error.h"

namespace terracast::core {
namespace {

constexpr int kNobody = 0;
constexpr int kProgram = -1;
constexpr std::array<int, 2> kStopSignals = {SIGTERM, SIGINT};

/// Who asked: a signal by its number. The one thing of the process that a signal handler may write to.
std::atomic<int> asked_by = kNobody;
static_assert(std::atomic<int>::is_always_lock_free);

std::atomic<unsigned> grace_s = 2;

/// Work that has not come to its next step is ended as by a power cut, which every file of ours survives.
extern "C" void end_without_waiting(int number) {
  if (asked_by.load(std::memory_order_relaxed) == kNobody) {  // somebody else's alarm
    ::signal(number, SIG_DFL);
    ::raise(number);
    return;
  }
  constexpr const char* kWords =
      "stopped on request, without waiting for what was at hand; run the same command again to go "
      "on\n";
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, kWords, std::strlen(kWords));
  ::_exit(exit_status(ErrorKind::Interrupted));
}

/// Who is to end stays so, whatever else asks.
extern "C" void ask_by_signal(int number) {
  int before = asked_by.load(std::memory_order_relaxed);
  const bool is_first = before != SIGTERM && before != SIGINT;
  if (is_first && (number == SIGTERM || number == SIGINT))
    ::alarm(grace_s.load(std::memory_order_relaxed));
  while (before != SIGTERM && before != SIGINT &&
         !asked_by.compare_exchange_weak(before, number, std::memory_order_relaxed)) {
  }
}

void catch_signal(int number, int flags) {
  struct sigaction before {};
  ::sigaction(number, nullptr, &before);
  if (before.sa_handler == SIG_IGN) return;  // as of what a shell starts in the background
  struct sigaction action {};
  action.sa_handler = ask_by_signal;
  action.sa_flags = flags | SA_RESTART;  // reads and writes go on
  ::sigemptyset(&action.sa_mask);
  ::sigaction(number, &action, nullptr);
}

}  // namespace

void catch_stop_signals() {
  struct sigaction late {};
  late.sa_handler = end_without_waiting;
  ::sigemptyset(&late.sa_mask);
  ::sigaction(SIGALRM, &late, nullptr);
  catch_signal(SIGTERM, 0);
  catch_signal(SIGINT, SA_RESETHAND);
}

void set_stop_grace(unsigned seconds) { grace_s.store(seconds, std::memory_order_relaxed); }

void catch_stop_signal(int number) { catch_signal(number, 0); }

StopSignalsEndTheProcess::StopSignalsEndTheProcess() {
  for (std::size_t i = 0; i < kStopSignals.size(); ++i) {
    ::sigaction(kStopSignals[i], nullptr, &before_[i]);
    if (before_[i].sa_handler != SIG_IGN) ::signal(kStopSignals[i], SIG_DFL);
  }
}

StopSignalsEndTheProcess::~StopSignalsEndTheProcess() {
  for (std::size_t i = 0; i < kStopSignals.size(); ++i)
    ::sigaction(kStopSignals[i], &before_[i], nullptr);
}

int stop_signal() { return std::max(kNobody, asked_by.load(std::memory_order_relaxed)); }

bool stop_asked() { return asked_by.load(std::memory_order_relaxed) != kNobody; }

void throw_if_stop_asked() {
  if (stop_asked())
    fail(ErrorKind::Interrupted, "stopped on request; run the same command again to go on");
}

void ask_to_stop() { asked_by.store(kProgram, std::memory_order_relaxed); }

bool forget_stop_signal(int number) {
  if (!asked_by.compare_exchange_strong(number, kNobody, std::memory_order_relaxed)) return false;
  ::alarm(0);
  return true;
}

void forget_stop() {
  ::alarm(0);
  asked_by.store(kNobody, std::memory_order_relaxed);
}

}  // namespace terracast::core
