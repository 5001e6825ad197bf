// What every identification method answers with, and what it is judged by.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <string>
#include <vector>

#include "core/joints.h"

namespace knuckle::estimation {

struct IdentifiedParameter {
  std::string name, unit;  ///< "J1", "kg m^2"
  double value = 0, sigma = 0;
  bool fixed = false;  ///< Taken from the machine file, not from the data.
};

/// Starts pessimistic: nothing is usable until a method says so.
struct Identification {
  std::string method;
  bool usable = false;
  std::vector<std::string> reasons{"not run"};  ///< Why not usable, or what to know before using it; each one line.
  std::vector<IdentifiedParameter> parameters;
  Eigen::MatrixXd covariance;  ///< In the order of `parameters`.
  enum class Sigmas : std::uint8_t {
    kOfResiduals,      ///< Too small: what the model leaves out and sensors have wrong does not show in them.
    kWithUsualErrors,  ///< Base parameters: with what usual_errors() change.
    kWithModelError,   ///< With FullOptions::model_error.
  } sigmas = Sigmas::kOfResiduals;
  double condition_number = 0;  ///< Of the weighted, column-scaled regressor.
  int rank = 0, columns = 0;
  std::vector<std::string> indistinct;  ///< Combinations that the data cannot tell apart, in words.
  double duration_s = 0;                ///< Of usable data.
};

/// Measured and modelled torque of one recording, joint by joint, at the recording's period.
struct TorqueComparison {
  double step_s = 0;
  std::vector<JointVector> measured_Nm, modelled_Nm;  ///< Friction is part of the model.
  std::vector<std::uint8_t> usable;
};

/// Figures of merit of a comparison, per joint. NaN where a method has no model of a joint
/// or no usable sample; nrmse and vaf also where the measured torque is constant.
struct TorqueFit {
  JointVector rms_Nm = JointVector::Zero();
  JointVector nrmse = JointVector::Zero();  ///< RMS(error) / std(measured)
  JointVector vaf = JointVector::Zero();    ///< 1 - var(error) / var(measured)
};

/// Both torques behind a zero-phase low-pass. What its window does not fit is no longer usable.
[[nodiscard]] TorqueComparison low_passed(const TorqueComparison& comparison, double cutoff_Hz);

/// @param cutoff_Hz of low_passed() before comparing; 0 compares as is.
[[nodiscard]] TorqueFit torque_fit(const TorqueComparison& comparison, double cutoff_Hz);

}  // namespace knuckle::estimation
