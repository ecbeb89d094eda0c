#pragma once

namespace depthservo::deluca2008 {

/// Step of a differential equation from t to t + h, Runge-Kutta of order 4. \param derivative of
/// (t, state)
template <class State, class Derivative>
State rungeKutta(const Derivative& derivative, double t, const State& x, double h) {
  const State k1 = derivative(t, x);
  const State k2 = derivative(t + h / 2, State(x + h / 2 * k1));
  const State k3 = derivative(t + h / 2, State(x + h / 2 * k2));
  const State k4 = derivative(t + h, State(x + h * k3));
  return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
}

}  // namespace depthservo::deluca2008
