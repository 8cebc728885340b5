!> The exact step with its exact derivative, `flow_tangent`: the effect of a small change of the momentum, the
!> attitude or the inertia on the state after the step. For filters, fits, shooting, Lyapunov exponents.
!>
!> Variations of the attitude are rotation vectors in body axes: q + dq = q (1, dtheta/2), the error state of
!> multiplicative Kalman filters. After the step
!>
!>     dm' = J dm,   dtheta' = W dm + E dtheta,   transition = [J 0; W E] on (dm, dtheta)
!>
!> J, W and E do not depend on q. By the time: dm'/dh = m' x I^-1 m', dtheta'/dh = I^-1 m'. Of two steps in
!> turn the transition is the product. In space axes: dtheta_space = Q' dtheta'.
!>
!> State, errors and extremes are those of free_flow, to which m and q agree to rounding. A refused step has
!> the derivatives of no step: 1, and 0 by the inertia. Every orbit is covered: spheres and symmetric bodies,
!> axes, the separatrix. Next to the unstable axis the derivative grows as exp(lambda h): entries beyond the
!> largest number are Inf, none is NaN (of a body by a tensor the sign of Inf has no meaning). Zero momentum:
!> J = E = 1, W = h I^-1. Angles beyond 2^64 are cut, as in free_flow: the derivative is then that of the
!> shorter time. A linear rotor has no momentum along its axis: derivatives by this component are 0. Of its
!> derivatives by the moments only the sum of the columns of the two equal moments has a meaning.
!>
!> Accuracy: J, W and the derivatives by the inertia within 4 units (medians within 0.5) of their own inherent
!> sensitivity, on 325 cases of data/reference and as many others; held by the suite `tangent`.
!>
!> Method: closed form, with three integrals more than the step: those of s^2, s^2/c^2 and s^2/d^2.
submodule(frb_free_flow) frb_flow_tangent
    use frb_flow_tangent_body, only: jacobian_body, tangent_body
    use frb_flow_tangent_many, only: tangent_many
    implicit none

contains

    module procedure tangent_of_momentum
        integer :: code

        call jacobian_body(body%core, h, m, code, jacobian)
        if (code /= status_ok .or. present(stat)) call return_or_stop(code, 'flow_tangent', stat)
    end procedure tangent_of_momentum

    module procedure tangent_of_state
        integer :: code

        call tangent_body(body%core, h, m, code, 0, q, transition)
        if (code /= status_ok .or. present(stat)) call return_or_stop(code, 'flow_tangent', stat)
    end procedure tangent_of_state

    module procedure tangent_and_inertia
        integer :: code

        code = status_bad_count
        if (size(by_moments, 1) == 6 .and. (size(by_moments, 2) == 3 .or. size(by_moments, 2) == 6)) then
            call tangent_body(body%core, h, m, code, size(by_moments, 2), q, transition, &
                              by_inertia=by_moments)
        else
            transition = 0.0_wp
            by_moments = 0.0_wp
        end if
        if (code /= status_ok .or. present(stat)) call return_or_stop(code, 'flow_tangent', stat)
    end procedure tangent_and_inertia

    module procedure tangent_and_tensor
        integer :: code

        call tangent_body(body%core, h, m, code, 6, q, transition, by_inertia=by_tensor)
        if (code /= status_ok .or. present(stat)) call return_or_stop(code, 'flow_tangent', stat)
    end procedure tangent_and_tensor

    module procedure tangent_of_states
        integer :: code

        code = status_bad_count
        if (size(m, 1) == 3 .and. size(q, 1) == 4 .and. size(q, 2) == size(m, 2) &
            .and. all(shape(transition) == [6, 6, size(m, 2)])) then
            call tangent_many(body%core, h, size(m, 2), m, q, transition, code)
        else
            transition = 0.0_wp
        end if
        call return_or_stop(code, 'flow_tangent', stat)
    end procedure tangent_of_states

end submodule frb_flow_tangent
