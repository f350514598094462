// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>

#include "base/check.h"

namespace photoslam {

/// Whether an exception has left something half changed.
class Wholeness {
 public:
  /// A change, for as long as this lives. When an exception ends it, half of it is all there is. Changes may nest.
  class Change {
   public:
    /// `what` names what is changed. Throws when it is not whole.
    Change(Wholeness& wholeness, const char* what)
        : wholeness_(wholeness), exceptions_before_(std::uncaught_exceptions()) {
      wholeness.check(what);
    }
    ~Change() {
      if (std::uncaught_exceptions() > exceptions_before_) wholeness_.is_whole_ = false;
    }
    Change(const Change&) = delete;
    Change& operator=(const Change&) = delete;

   private:
    Wholeness& wholeness_;
    int exceptions_before_;
  };

  bool is_whole() const { return is_whole_; }
  /// Throws unless it is.
  void check(const char* what) const { PHOTOSLAM_CHECK(is_whole_, "{}: an error has left it half changed", what); }

 private:
  bool is_whole_ = true;
};

}  // namespace photoslam
