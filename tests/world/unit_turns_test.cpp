#include "world/unit_turns.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace terracast::world {
namespace {

using Order = UnitTurns::Unit::Order;

class UnitTurnsTest : public testing::Test {
 protected:
  void start_all() {
    for (UnitTurns::Unit& unit : units_) turns_.start(unit);
  }
  void wait(std::size_t unit, const std::vector<TileDemand>& demands) {
    turns_.wait(units_[unit], demands);
  }

  UnitTurns turns_;
  std::array<UnitTurns::Unit, 4> units_;
};

TEST_F(UnitTurnsTest, AsManyRunAsThereAreProcessors) {
  turns_.set_num_processors(2);
  start_all();
  EXPECT_EQ(units_[0].order, Order::Run);
  EXPECT_EQ(units_[1].order, Order::Run);
  EXPECT_EQ(units_[2].order, Order::Wait);
  turns_.finish();
  EXPECT_EQ(units_[2].order, Order::Run);
  EXPECT_EQ(units_[3].order, Order::Wait);
}

TEST_F(UnitTurnsTest, ATileIsLoadedOnlyWhenNoUnitCanGoOn) {
  start_all();
  wait(0, {{7, 5}});
  EXPECT_EQ(units_[0].order, Order::Wait);
  EXPECT_EQ(units_[1].order, Order::Run);
  wait(1, {{8, 3}, {9, 3}});
  wait(2, {{9, 3}});
  EXPECT_EQ(units_[3].order, Order::Run);
  turns_.finish();
  // Most rays of all wait for tile 9, although no unit has most of its own there.
  EXPECT_EQ(units_[0].order, Order::Wait);
  EXPECT_EQ(units_[1].order, Order::Load);
  EXPECT_EQ(units_[1].tile_index, 9U);
  EXPECT_EQ(units_[2].order, Order::Wait);
}

TEST_F(UnitTurnsTest, ALoadedTileIsPromisedToAllThatWaitForIt) {
  start_all();
  wait(0, {{9, 4}});
  wait(1, {{9, 4}, {5, 1}});
  wait(2, {{5, 2}});
  turns_.finish();
  ASSERT_EQ(units_[0].order, Order::Load);
  turns_.arrive(9);
  EXPECT_TRUE(turns_.is_promised(9));
  EXPECT_EQ(units_[1].order, Order::Wait);  // the one that loaded it runs
  turns_.finish();
  EXPECT_EQ(units_[1].order, Order::Use);
  EXPECT_EQ(units_[1].tile_index, 9U);
  turns_.keep_promise(9);
  EXPECT_FALSE(turns_.is_promised(9));
  turns_.finish();
  EXPECT_EQ(units_[2].order, Order::Load);
  EXPECT_EQ(units_[2].tile_index, 5U);
}

TEST_F(UnitTurnsTest, AFailedLoadIsLeftToTheNextUnitThatWaitsForTheTile) {
  start_all();
  wait(0, {{9, 1}});
  wait(1, {{9, 1}});
  wait(2, {{9, 1}});
  turns_.finish();
  ASSERT_EQ(units_[0].order, Order::Load);
  turns_.give_up_load(9);
  EXPECT_EQ(units_[1].order, Order::Wait);  // units_[0] has its processor still
  turns_.finish();
  EXPECT_EQ(units_[1].order, Order::Load);
}

TEST_F(UnitTurnsTest, TilesThatOthersLoadAreNotLoadedTwice) {
  start_all();
  turns_.begin_load(9);
  wait(0, {{9, 6}});
  wait(1, {{5, 1}});
  wait(2, {{9, 6}});
  turns_.finish();
  EXPECT_EQ(units_[1].order, Order::Load);
  EXPECT_EQ(units_[1].tile_index, 5U);
  turns_.arrive(9);
  turns_.finish();
  EXPECT_EQ(units_[0].order, Order::Use);
}

}  // namespace
}  // namespace terracast::world
