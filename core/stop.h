#pragma once

#include <signal.h>

#include <array>

namespace terracast::core {

/// From now on SIGTERM and SIGINT ask the work of this process to stop, instead of ending it. Work that waits for something
/// else, such as a library that reads a file without an end, is ended two seconds later, with status 75. A second
/// SIGINT ends the process at once, as it does by default. A signal that is ignored stays so.
void catch_stop_signals();

/// How long work is waited for, in place of two seconds, by a process that has to give something back before it ends.
void set_stop_grace(unsigned seconds);

/// The same for another signal that a process is asked to take so.
void catch_stop_signal(int number);

/// While it lives, SIGTERM and SIGINT end the process, as where catch_stop_signals() was not called: for foreign code that
/// runs before any work has begun, and may hang. Threads: one.
class StopSignalsEndTheProcess {
 public:
  StopSignalsEndTheProcess();
  ~StopSignalsEndTheProcess();
  StopSignalsEndTheProcess(const StopSignalsEndTheProcess&) = delete;
  StopSignalsEndTheProcess& operator=(const StopSignalsEndTheProcess&) = delete;

 private:
  std::array<struct sigaction, 2> before_;
};

/// The signal that asked: SIGTERM or SIGINT, the first of them, or else the last; 0: none has, or the
/// program itself asked.
int stop_signal();

/// Whether a stop was asked for: by a signal, or by ask_to_stop. Costs a load from memory. Threads:
/// safe.
bool stop_asked();

/// What work does before each of its steps that can be done again (core/parallel.h does so before each
/// index).
/// throws   Interrupted: a stop was asked for
void throw_if_stop_asked();

/// Asks as a signal does.
void ask_to_stop();

/// Takes back what a signal asked, for a last step of a process that ends.
/// returns   whether it was this one that asked, so that nobody asks any more
bool forget_stop_signal(int number);

/// Takes the asking back, whoever asked: for tests.
void forget_stop();

}  // namespace terracast::core
