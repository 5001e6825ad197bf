// Questions at a terminal that take one of a few words for an answer, asked while the machine's loop goes on. Any other
// answer ends the commissioning: a word typed by mistake must never move a machine.
#pragma once

#include <functional>
#include <initializer_list>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace knuckle::bringup {

/// Why commissioning ended before its end. The machine is neutral when it is caught.
class CommissionEnded : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Lines typed by a person or a script, without waiting for them.
class LineInput {
 public:
  explicit LineInput(int descriptor) noexcept : descriptor_(descriptor) {}
  /// The next whole line, if there is one by now. @throws CommissionEnded where the input has ended.
  [[nodiscard]] std::optional<std::string> poll();

 private:
  int descriptor_;
  std::string pending_;
  bool ended_ = false;
};

class Dialogue {
 public:
  /// What is asked, for whoever shows it otherwise than as a line of text.
  struct Question {
    std::string text;
    std::vector<std::string> words;                   ///< One of these is the answer,
    std::optional<std::pair<double, double>> bounds;  ///< or a number within these.
  };
  struct Input {
    std::function<std::optional<std::string>()> poll;  ///< As LineInput::poll().
    /// A person types as it goes: what was typed before a question is no answer to it, and anything typed while
    /// something moves means stop. A script's lines are all there from the beginning.
    bool live = false;
    std::function<void(const Question&)> asked{};          ///< Told of every question; may be empty.
    std::function<void(int, const std::string&)> began{};  ///< Told of every step: its number and title; likewise.
  };
  /// @param idle lets the machine go on for a moment; called until there is an answer.
  Dialogue(std::ostream& out, Input input, std::function<void()> idle)
      : out_(out), input_(std::move(input)), idle_(std::move(idle)) {}

  void say(const std::string& line);
  /// A step of the commissioning begins.
  void begin(int number, const std::string& title);
  /// @return which of the words. @throws CommissionEnded for any other answer.
  int ask(const std::string& question, std::initializer_list<const char*> words);
  /// @throws CommissionEnded for anything but a number within the bounds.
  /// @param known where the answer is known without asking (on a simulated machine), the word "tape" takes it.
  double ask_number(const std::string& question, double low, double high, std::optional<double> known = {});
  /// Whether a person typed anything: while something moves, that means stop.
  [[nodiscard]] bool interrupted();

 private:
  std::string answer(Question question);

  std::ostream& out_;
  Input input_;
  std::function<void()> idle_;
};

}  // namespace knuckle::bringup
