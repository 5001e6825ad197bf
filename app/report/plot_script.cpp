#include "app/report/plot_script.h"

namespace knuckle::report {

PlotScript::PlotScript(const session::SessionRecord& record, int panels, const std::vector<PlotMark>& marks)
    : record_(record), plot_(panels) {
  t_s_.reserve(record.samples.size());
  for (const session::Sample& sample : record.samples) t_s_.push_back(sample.t_s);
  for (const session::EventRecord& event : record.events) plot_.mark(event.t_s);
  for (const PlotMark& mark : marks) plot_.mark(mark.t_s, mark.label);
}

std::vector<double> PlotScript::values(const Signal& signal) const {
  std::vector<double> y;
  y.reserve(record_.samples.size());
  for (const session::Sample& sample : record_.samples) y.push_back(signal(sample));
  return y;
}

void PlotScript::line(const Signal& signal, const std::string& title, const char* colour, const std::string& style) {
  plot_.line(t_s_, values(signal), title, colour, style);
}

void PlotScript::band(const Signal& low, const Signal& high, const std::string& title, const char* colour) {
  plot_.band(t_s_, values(low), values(high), title, colour);
}

std::string PlotScript::finish() {
  return plot_.finish(t_s_.empty() ? 0 : t_s_.front(), t_s_.empty() ? 1 : t_s_.back());
}

}  // namespace knuckle::report
