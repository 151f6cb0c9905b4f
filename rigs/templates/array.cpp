#include "rigs/rig_template.h"

namespace terracast::rigs {
namespace {

/// Parallel cameras on a plane across the rig's x axis, the plane's middle at the rig's origin.
class ArrayRig final : public RigTemplate {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rows", rows_, "Rows, the first one on top.", core::between(1, 24));
    visit.key("columns", columns_, "Columns, the first one on the left.", core::between(1, 24));
    visit.key("row_spacing_mm", row_spacing_mm_, "From row to row.", core::between(0.0, 1e6));
    visit.key("column_spacing_mm", column_spacing_mm_, "From column to column.",
              core::between(0.0, 1e6));
  }
  std::unique_ptr<RigTemplate> clone() const override { return std::make_unique<ArrayRig>(*this); }
  std::vector<CameraPlace> places() const override {
    std::vector<CameraPlace> places;
    const auto from_middle = [](std::int64_t index, std::int64_t count) {
      return static_cast<double>(index) - 0.5 * static_cast<double>(count - 1);
    };
    for (std::int64_t row = 0; row < rows_; ++row)
      for (std::int64_t column = 0; column < columns_; ++column)
        places.push_back(
            {fmt::format("{}_{}", row, column),
             rig_from_camera_of_euler_deg(0.0, 0.0,
                                          {0.0, -column_spacing_mm_ * from_middle(column, columns_),
                                           -row_spacing_mm_ * from_middle(row, rows_)})});
    return places;
  }

 private:
  std::int64_t rows_ = 3;
  std::int64_t columns_ = 3;
  double row_spacing_mm_ = 100.0;
  double column_spacing_mm_ = 100.0;
};

}  // namespace

RigTemplateInfo array_rig() {
  return {.name = "array",
          .summary = "Parallel cameras in rows and columns on a plane.",
          .make = [] { return std::unique_ptr<RigTemplate>(new ArrayRig); }};
}

}  // namespace terracast::rigs
