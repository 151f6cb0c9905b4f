#include "core/stop.h"

#include <signal.h>

#include <atomic>

#include "core/error.h"

namespace terracast::core {
namespace {

/// The one thing of the process that a signal handler may write to.
std::atomic<bool> is_asked = false;
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void ask_by_signal(int) { is_asked.store(true, std::memory_order_relaxed); }

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
  catch_signal(SIGTERM, 0);
  catch_signal(SIGINT, SA_RESETHAND);
}

bool stop_asked() { return is_asked.load(std::memory_order_relaxed); }

void throw_if_stop_asked() {
  if (stop_asked())
    fail(ErrorKind::Interrupted, "stopped on request; run the same command again to go on");
}

void ask_to_stop() { is_asked.store(true, std::memory_order_relaxed); }

void forget_stop() { is_asked.store(false, std::memory_order_relaxed); }

}  // namespace terracast::core
