// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

namespace cgs {

/// Base of everything this project throws on purpose; main() turns it into an exit code.
class Error : public std::runtime_error {
 public:
  /// Control characters of the message, which may quote a file, are escaped.
  Error(int exit_code, const std::string& message);
  int exit_code() const { return exit_code_; }

 private:
  int exit_code_;
};

/// An option or argument breaks a documented precondition (exit code 2).
class InvalidInput : public Error {
 public:
  explicit InvalidInput(const std::string& message) : Error(2, message) {}
};

/// What is wrong with the content of a file or data set; each has a stable upper-case name.
enum class Defect {
  Empty,
  Open,
  Magic,
  Syntax,
  Schema,
  Unsupported,
  Truncated,
  Count,
  Value,
  Ref,
  Path,
  Missing,
  Mismatch
};

std::string_view defect_name(Defect defect);

/// A file or data set cannot be used (exit code 3). what() is one line:
/// "TRUNCATED: <path>: <place, what was found, what is allowed>".
class BadInput : public Error {
 public:
  BadInput(Defect defect, const std::filesystem::path& path, const std::string& reason);
  Defect defect() const { return defect_; }

 private:
  Defect defect_;
};

/// A declared size or a predicted cost is above a limit or the memory budget (exit code 4).
class LimitError : public Error {
 public:
  explicit LimitError(const std::string& message) : Error(4, "LIMIT: " + message) {}
};

/// The file system refused: cannot create, write, flush or rename (exit code 5).
class IoError : public Error {
 public:
  IoError(const std::filesystem::path& path, const std::string& reason);
};

/// An algorithm cannot give a finite answer for this input (exit code 6).
class NumericalError : public Error {
 public:
  explicit NumericalError(const std::string& message) : Error(6, message) {}
};

/// The user or a callback asked to stop (exit code 130).
class Cancelled : public Error {
 public:
  Cancelled() : Error(130, "interrupted") {}
};

/// Text fit for one line on a terminal: control characters are escaped, other bytes stay.
std::string one_line(std::string_view text);

/// A path fit for one line on a terminal: control characters and invalid bytes are escaped.
std::string printable(const std::filesystem::path& path);

/// Throws InvalidInput "<rule>, but is <value>" unless the condition holds. Write conditions so
/// that NaN fails them.
template <typename T>
void require(bool condition, std::string_view rule, const T& value) {
  if (condition) return;
  std::ostringstream message;
  message << rule << ", but is " << value;
  throw InvalidInput(message.str());
}

}  // namespace cgs
