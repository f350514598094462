// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace photoslam {

/// Describes one configuration value; the manual, the validation and the reports are generated from it.
struct OptionInfo {
  const char* name;
  const char* unit;  ///< "px", "m", "s", …; "" when dimensionless.
  double min;        ///< Smallest legal value; ignored for text and switches.
  double max;        ///< Largest legal value.
  const char* doc;   ///< Effect, and when to change it.
};

/// Walks the values of option structs.
///
/// Every options struct has `void visit(OptionVisitor&)` that calls value() once per member, in order. Current member
/// values at the time of the visit are what a reader sees; a writer may change them.
class OptionVisitor {
 public:
  virtual ~OptionVisitor() = default;
  virtual void begin_group(const char* name, const char* doc) = 0;
  virtual void end_group() = 0;
  virtual void value(const OptionInfo& info, bool& v) = 0;
  virtual void value(const OptionInfo& info, int& v) = 0;
  virtual void value(const OptionInfo& info, double& v) = 0;
  virtual void value(const OptionInfo& info, std::string& v) = 0;

  /// Visits a nested options struct as a group.
  template <class Options>
  void group(const char* name, const char* doc, Options& options) {
    begin_group(name, doc);
    options.visit(*this);
    end_group();
  }
};

}  // namespace photoslam
