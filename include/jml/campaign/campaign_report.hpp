// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The files of a campaign (component jml::campaign): CSV of all samples, JSON summary, JSON of the times.
///
/// Numbers are the shortest text that reads back to the same double, so equal figures give equal bytes.
#include <jml/warnings_begin.hpp>
#pragma once

#include <charconv>
#include <fstream>
#include <jml/campaign/campaign_result.hpp>
#include <nlohmann/json.hpp>

namespace jml {

namespace detail {

using Json = nlohmann::ordered_json;

/// Empty for NaN.
inline void append_number(std::string& line, double number) {
  if (std::isnan(number)) return;
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, number).ptr;
  line.append(text, end);
}

/// A text as one CSV field (RFC 4180).
inline std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out.append(c == '"' ? 2 : 1, c);
  return out + '"';
}

inline Json json_figure(const Figure& f) {
  return {{"value", f.value}, {"standard_error", f.standard_error}, {"low", f.low}, {"high", f.high}};
}

inline Json json_faults(const std::vector<RunFault>& faults) {
  Json out = Json::array();
  for (const RunFault& fault : faults) {
    Json one = {{"run", fault.run}, {"step", fault.step}, {"reason", describe(fault.kind)}};
    if (fault.kind == RunFault::Kind::prediction_refused) one["status"] = describe(fault.status);
    if (fault.kind == RunFault::Kind::lost) one["error"] = fault.scalar_error;
    out.push_back(std::move(one));
  }
  return out;
}

inline bool write_file(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  return file.good();
}

/// As text; a name that is no UTF-8 keeps a mark in place of what cannot be read.
inline std::string json_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

/// The columns of one figure.
inline void append_figure(std::string& line, const Figure& f) {
  for (const double number : {f.value, f.standard_error, f.low, f.high}) {
    line += ',';
    append_number(line, number);
  }
}
inline void append_figure_names(std::string& line, const std::string& name) {
  line += ',' + name + ',' + name + "_se," + name + "_low," + name + "_high";
}

}  // namespace detail

inline bool CampaignResult::write_csv(const std::string& path) const {
  if (!ok()) return false;
  if (!writes_) return true;
  const detail::CampaignData& d = *data_;
  std::string text = "estimator,step,time,runs";
  detail::append_figure_names(text, "rmse");
  for (const char* name : {"nees", "nis", "cost"}) detail::append_figure_names(text, name);
  text += ",refused,rejected,contained";
  for (int i = 1; i <= d.layout.states; ++i) {
    const std::string index = '_' + std::to_string(i);
    for (const char* name : {"mean_error", "mse", "rmse"}) detail::append_figure_names(text, name + index);
    text += ",contained" + index + ",width" + index;
  }
  text += '\n';
  for (int j = 0; j < d.layout.estimators; ++j) {
    const EstimatorFigures figures = estimator(j);
    const std::string name = detail::csv_field(figures.name());
    for (int k = d.measured_at_start ? 0 : 1; k <= d.layout.steps; ++k) {
      const SampleFigures sample = figures.at(k);
      text += name + ',' + std::to_string(k) + ',';
      detail::append_number(text, k * d.dt);
      text += ',' + std::to_string(sample.kept());
      for (const Figure& f : {sample.rmse(), sample.nees(), sample.nis(), sample.cost()})
        detail::append_figure(text, f);
      text += ',' + std::to_string(sample.refused()) + ',' + std::to_string(sample.rejected()) + ',';
      detail::append_number(text, sample.contained());
      for (int i = 0; i < d.layout.states; ++i) {
        for (const Figure& f : {sample.mean_error(i), sample.mse(i), sample.rmse(i)})
          detail::append_figure(text, f);
        text += ',';
        detail::append_number(text, sample.contained(i));
        text += ',';
        detail::append_number(text, sample.width(i));
      }
      text += '\n';
    }
  }
  return detail::write_file(path, text);
}

inline bool CampaignResult::write_json(const std::string& path) const {
  if (!ok()) return false;
  if (!writes_) return true;
  const detail::CampaignData& d = *data_;
  detail::Json json = {{"scenario", d.scenario},
                       {"version", d.options.version},
                       {"runs", d.options.runs},
                       {"seed", d.options.seed},
                       {"blocks", d.options.blocks},
                       {"states", d.layout.states},
                       {"steps", d.layout.steps},
                       {"dt", d.dt},
                       {"measured_at_start", d.measured_at_start}};
  if (d.options.count != d.options.blocks)
    json["part"] = {{"first_block", d.options.first}, {"count", d.options.count}};
  detail::Json& list = json["estimators"] = detail::Json::array();
  for (int j = 0; j < d.layout.estimators; ++j) {
    const EstimatorFigures figures = estimator(j);
    list.push_back({{"name", figures.name()},
                    {"runs", figures.kept()},
                    {"run_rmse", detail::json_figure(figures.run_rmse())},
                    {"nees", detail::json_figure(figures.nees())},
                    {"nis", detail::json_figure(figures.nis())},
                    {"cost", detail::json_figure(figures.cost())},
                    {"refused_steps", figures.refused()},
                    {"rejected_measurements", figures.rejected()},
                    {"failed", detail::json_faults(figures.failed())},
                    {"lost", detail::json_faults(figures.lost())}});
  }
  detail::Json& pairs = json["paired_differences"] = detail::Json::array();
  for (int j = 0; j < d.layout.estimators; ++j) {
    for (int other = 0; other < d.layout.estimators; ++other) {
      if (other == j) continue;
      pairs.push_back({{"of", estimator(j).name()},
                       {"minus", estimator(other).name()},
                       {"runs", this->pairs(j, other)},
                       {"run_rmse", detail::json_figure(difference(j, other))}});
    }
  }
  return detail::write_file(path, detail::json_text(json));
}

inline bool CampaignResult::write_timings(const std::string& path) const {
  if (!ok()) return false;
  if (!writes_) return true;
  using L = detail::TallyLayout;
  detail::Json json = {{"wall_seconds", data_->wall_seconds},
                       {"threads", data_->threads},
                       {"ranks", data_->ranks},
                       {"blocks_taken_over", data_->blocks_taken_over},
                       {"share_inside_estimators", share_inside()}};
  detail::Json& list = json["estimators"] = detail::Json::array();
  for (int j = 0; j < data_->layout.estimators; ++j) {
    const double* times = data_->times.data() + L::times * j;
    list.push_back({{"name", estimator(j).name()},
                    {"ns_per_step", times[L::inside_ns] / times[L::flown_steps]},
                    {"covariance_ns_per_step", times[L::covariance_ns] / times[L::flown_steps]},
                    {"steps", times[L::flown_steps]}});
  }
  return detail::write_file(path, detail::json_text(json));
}

}  // namespace jml
#include <jml/warnings_end.hpp>
