#pragma once

#include <string>

namespace terracast::test {

/// What befalls the workers of a batch, their disk and their clocks.
enum class Fault {
  Kill,
  Stop,         ///< past the lease; then it goes on
  StopAndKill,  ///< past the lease; then it is killed
  FullDisk,
  ReadOnly,
  DamageAtRest,  ///< while nobody works
  DamageAtWork,
  ClockAhead,    ///< of all workers, by two days
  ClocksDiffer,  ///< between workers
  ClockJump,     ///< in the middle
};
inline constexpr Fault kFaults[] = {Fault::Kill,         Fault::Stop,       Fault::StopAndKill,
                                    Fault::FullDisk,     Fault::ReadOnly,   Fault::DamageAtRest,
                                    Fault::DamageAtWork, Fault::ClockAhead, Fault::ClocksDiffer,
                                    Fault::ClockJump};

std::string fault_name(Fault fault);

bool is_of_disk(Fault fault);
bool is_of_clock(Fault fault);

}  // namespace terracast::test
