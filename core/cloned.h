#pragma once

#include <memory>
#include <utility>

namespace terracast::core {

/// Owns one of several kinds of things, and copies it by its clone(); or nothing.
template <class T>
class Cloned {
 public:
  Cloned() = default;
  Cloned(std::unique_ptr<T> value)  // NOLINT(google-explicit-constructor)
      : value_(std::move(value)) {}
  Cloned(const Cloned& other) : value_(other.value_ ? other.value_->clone() : nullptr) {}
  Cloned(Cloned&&) noexcept = default;
  Cloned& operator=(Cloned other) noexcept {
    value_ = std::move(other.value_);
    return *this;
  }
  ~Cloned() = default;

  explicit operator bool() const { return value_ != nullptr; }
  T& operator*() { return *value_; }
  const T& operator*() const { return *value_; }
  T* operator->() { return value_.get(); }
  const T* operator->() const { return value_.get(); }

 private:
  std::unique_ptr<T> value_;
};

}  // namespace terracast::core
