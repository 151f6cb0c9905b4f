#pragma once

namespace terracast::core {

/// The memory of this process that is resident now, bytes; 0: the system does not say.
double resident_bytes();

/// Has malloc() keep freed memory in as many pools as there are processors, where it would take eight times as many: threads
/// of one pool use what the others have freed, so that less need be given back to the system to hold a budget. For the start
/// of a program, before its threads. MALLOC_ARENA_MAX and GLIBC_TUNABLES go before.
void share_freed_memory();

/// Gives freed memory back to the system as far as whole pages are free. Costs a call of the system for each free piece,
/// whether it was given back before or not: tens of ms for some 100 MB of small pieces.
void give_freed_memory_back();

}  // namespace terracast::core
