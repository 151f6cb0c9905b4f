#include "core/stop.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <time.h>
#include <unistd.h>

#include "core/error.h"

namespace terracast::core {
namespace {

// Handlers are the whole process's: each test of them has a process of its own, which tells what it
// saw by its exit status.

TEST(StopDeathTest, SigtermAndTheFirstSigintAskAndEndNothing) {
  for (const int number : {SIGTERM, SIGINT}) {
    EXPECT_EXIT(
        {
          catch_stop_signals();
          const bool was_asked = stop_asked();
          ::raise(number);
          ::_exit(!was_asked && stop_asked() ? 0 : 1);
        },
        testing::ExitedWithCode(0), "");
  }
}

TEST(StopDeathTest, ASecondSigintEndsTheProcessAndASecondSigtermDoesNot) {
  EXPECT_EXIT(
      {
        catch_stop_signals();
        ::raise(SIGTERM);
        ::raise(SIGTERM);
        ::raise(SIGINT);
        ::raise(SIGINT);
        ::_exit(0);
      },
      testing::KilledBySignal(SIGINT), "");
}

TEST(StopDeathTest, AnIgnoredSignalStaysIgnored) {
  EXPECT_EXIT(
      {
        ::signal(SIGINT, SIG_IGN);
        catch_stop_signals();
        ::raise(SIGINT);
        ::raise(SIGINT);
        ::_exit(stop_asked() ? 1 : 0);
      },
      testing::ExitedWithCode(0), "");
}

TEST(StopDeathTest, AnotherSignalAsksWhereItIsCaughtAndTheLastOneIsTold) {
  EXPECT_EXIT(
      {
        catch_stop_signals();
        catch_stop_signal(SIGUSR1);
        const bool is_told_of_none = stop_signal() == 0;
        ::raise(SIGUSR1);
        const bool is_asked = stop_asked() && stop_signal() == SIGUSR1;
        ::raise(SIGTERM);
        ::_exit(is_told_of_none && is_asked && stop_signal() == SIGTERM ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
  EXPECT_EXIT(
      {
        catch_stop_signals();
        ::raise(SIGUSR1);
        ::_exit(0);
      },
      testing::KilledBySignal(SIGUSR1), "");
}

TEST(StopDeathTest, WhoIsToEndStaysSoWhateverAsksLater) {
  for (const int number : {SIGTERM, SIGINT}) {
    EXPECT_EXIT(
        {
          catch_stop_signals();
          catch_stop_signal(SIGUSR1);
          ::raise(number);
          ::raise(SIGUSR1);
          ::_exit(stop_signal() == number && !forget_stop_signal(SIGUSR1) && stop_asked() ? 0 : 1);
        },
        testing::ExitedWithCode(0), "");
  }
  EXPECT_EXIT(
      {
        catch_stop_signal(SIGUSR1);
        ::raise(SIGUSR1);
        ::_exit(forget_stop_signal(SIGUSR1) && !stop_asked() ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

TEST(StopDeathTest, WorkThatDoesNotComeToItsNextStepIsEndedTwoSecondsLater) {
  const auto wait = [](double longest_s) {
    timespec begun{}, now{};
    for (::clock_gettime(CLOCK_MONOTONIC, &begun), now = begun;
         static_cast<double>(now.tv_sec - begun.tv_sec) < longest_s;
         ::clock_gettime(CLOCK_MONOTONIC, &now)) {
    }
  };
  EXPECT_EXIT(
      {
        catch_stop_signals();
        ::raise(SIGTERM);
        ::raise(SIGTERM);  // does not put it off
        wait(60.0);
        ::_exit(0);
      },
      testing::ExitedWithCode(75), "run the same command again");
  // What takes the asking back has the time that it needs.
  EXPECT_EXIT(
      {
        catch_stop_signals();
        ::raise(SIGTERM);
        ::_exit(forget_stop_signal(SIGTERM) ? (wait(4.0), 0) : 1);
      },
      testing::ExitedWithCode(0), "");
  EXPECT_EXIT(
      {
        catch_stop_signals();
        ::alarm(1);  // somebody else's
        wait(60.0);
        ::_exit(0);
      },
      testing::KilledBySignal(SIGALRM), "");
}

TEST(StopTest, AskingThrowsUntilItIsTakenBack) {
  EXPECT_FALSE(stop_asked());
  EXPECT_NO_THROW(throw_if_stop_asked());
  ask_to_stop();
  EXPECT_TRUE(stop_asked());
  EXPECT_EQ(stop_signal(), 0) << "no signal asked";
  try {
    throw_if_stop_asked();
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Interrupted);
  }
  forget_stop();
  EXPECT_NO_THROW(throw_if_stop_asked());
}

}  // namespace
}  // namespace terracast::core
