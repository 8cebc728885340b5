!> A rigid body, `rigid_body`, and its exact free flow, `free_flow`: momentum only, with a quaternion, with a
!> matrix; for one body and for many. One formula holds for all orbits, without special cases; no input of
!> finite numbers fails.
!>
!> State: m, angular momentum in the body; q or a, attitude, body to space. Any consistent units. Both are
!> advanced in place by the time h, of any sign and size. Short steps, by series, add increments to m and q:
!> rounding errors of N steps grow like a random walk, and the norms do not drift. A longer step multiplies q
!> by a turn of norm one to rounding: if all steps are equal, rounding can add up by at most one epsilon per
!> step. Within this error a quaternion keeps its norm, and a matrix its defect of orthogonality. A body by
!> its tensor keeps as much as the same body by its moments (suite `drifts`).
!>
!> Errors (`stat`): the status of a body that could not be made; `status_bad_momentum`, `status_bad_time`,
!> `status_bad_attitude` for NaN, Inf and a quaternion of norm zero; `status_bad_count` for arrays that do not
!> match. A refused state does not change. Zero momentum, h = 0 and n = 0 are the identity. With `stat`
!> present the calls for one body are pure: they can stand in pure procedures and in `do concurrent`.
!>
!> Linear rotors: the momentum along the axis of the zero moment must be 0. Up to 1e-8 of the momentum counts
!> as rounding and is removed; more is refused with `status_bad_momentum`.
!>
!> Accuracy: m and attitude within 2 units (medians within 0.5) of the inherent sensitivity, on the 325 cases
!> of data/reference and as many of another seed; largest seen 1.6. Held by the suite `free-flow`.
!> A million steps, and ten million, keep |m|, |q| and the energy to 1e-12. Held by the suite `flow-runs`.
!> Phases have no digits left when the angle turned in one step passes 2^53; the state is then on the right
!> orbit, at an arbitrary phase.
module frb_free_flow
    use frb_flow_bodies, only: flow_many
    use frb_flow_one, only: flow_body
    use frb_inertia, only: axes_of, body_core, core_from_moments, core_from_tensor
    use frb_kinds, only: wp
    use frb_status, only: return_or_stop, status_ok, status_bad_attitude, status_bad_count
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc
    implicit none
    private

    public :: rigid_body, free_flow, flow_tangent, core_of, core_alone, cores_of, turn_matrix

    !> A rigid body: `body = rigid_body(moments)` or `body = rigid_body(tensor)`. Its components are private,
    !> so that all routines see the same body; the functions below read it.
    type :: rigid_body
        private
        type(body_core) :: core
    contains
        procedure :: status => status_of_body    !! `status_ok`, or why it could not be made
        procedure :: moments => moments_of_body    !! principal moments (3)
        procedure :: axes => axes_of_body    !! principal axes, as columns (3, 3)
        procedure :: is_linear => body_is_linear    !! whether one moment is 0
    end type rigid_body

    !> Makes a body from its principal moments(3), in any order, or from its inertia tensor(3,3) about the
    !> centre of mass or the fixed point; any consistent units. `body%status()` says whether that was
    !> possible: `status_bad_moments` unless the moments are finite, positive and not denormal,
    !> `status_bad_tensor` unless the tensor is finite, symmetric to 8 roundings and positive definite.
    !>
    !> With a tensor, momentum and attitude are in the axes of the tensor. Off its diagonal it has the
    !> negative products of inertia: tensor(1,2) = - integral of x y dm. Files that list Ixy = + integral of
    !> x y dm need the sign changed.
    !>
    !> One zero moment and two equal ones, or such a tensor (to 16 roundings of the largest moment), are a
    !> linear rotor: a linear molecule. Other zero moments are refused.
    !>
    !> The triangle inequality I1 + I2 >= I3 is not required: the equations of motion do not need it, and
    !> models of bodies with rotors or of fluids in ellipsoids have moments that violate it.
    interface rigid_body
        module procedure body_from_moments
        module procedure body_from_tensor
    end interface rigid_body

    !> Advances the state of one body or of n bodies by the time h, in place:
    !> `call free_flow(body, h, m [, q or a] [, stat])`; body is one body or body(n), m is (3) or (3,n),
    !> q is (4) or (4,n), a is (3,3).
    interface free_flow
        module procedure flow_momentum
        module procedure flow_momentum_or_stop
        module procedure flow_quaternion
        module procedure flow_quaternion_or_stop
        module procedure flow_matrix
        module procedure flow_matrix_or_stop
        module procedure flow_momenta
        module procedure flow_quaternions
        module procedure flow_momenta_of_bodies
        module procedure flow_quaternions_of_bodies
    end interface free_flow

    !> Advances the state of one body or of n equal bodies by h, in place, with its exact derivatives:
    !>
    !>     call flow_tangent(body, h, m, jacobian [, stat])
    !>     call flow_tangent(body, h, m, q, transition [, stat])
    !>     call flow_tangent(body, h, m, q, transition, by_moments [, stat])
    !>     call flow_tangent(body, h, m, q, transition, by_tensor=by_tensor [, stat=stat])
    !>
    !> frb_flow_tangent defines these derivatives and states their accuracy.
    interface flow_tangent
        !> The momentum alone: no attitude cost.
        module subroutine tangent_of_momentum(body, h, m, jacobian, stat)
            implicit none
            type(rigid_body), intent(in) :: body
            real(wp), intent(in) :: h                       !! time, any sign
            real(wp), intent(inout) :: m(3)                 !! body angular momentum
            real(wp), intent(out) :: jacobian(3, 3)         !! J: dm' = J dm
            integer, intent(out), optional :: stat
        end subroutine tangent_of_momentum

        !> Momentum and attitude.
        module subroutine tangent_of_state(body, h, m, q, transition, stat)
            implicit none
            type(rigid_body), intent(in) :: body
            real(wp), intent(in) :: h                       !! time, any sign
            real(wp), intent(inout) :: m(3)                 !! body angular momentum
            real(wp), intent(inout) :: q(4)                 !! attitude, scalar first, body to space; not zero
            real(wp), intent(out) :: transition(6, 6)       !! [J 0; W E] on (dm, dtheta)
            integer, intent(out), optional :: stat
        end subroutine tangent_of_state

        !> The same with the derivatives of (m', theta') by the inertia.
        module subroutine tangent_and_inertia(body, h, m, q, transition, by_moments, stat)
            implicit none
            type(rigid_body), intent(in) :: body
            real(wp), intent(in) :: h
            real(wp), intent(inout) :: m(3), q(4)
            real(wp), intent(out) :: transition(6, 6)
            !> (6, 3): by the principal moments, in the order of `body%moments()`, axes held. (6, 6): by the
            !> elements of the tensor, see by_tensor. `status_bad_count` for any other shape.
            real(wp), intent(out), contiguous :: by_moments(:, :)
            integer, intent(out), optional :: stat
        end subroutine tangent_and_inertia

        !> The same by the elements of the inertia tensor in the axes of the body.
        module subroutine tangent_and_tensor(body, h, m, q, transition, stat, by_tensor)
            implicit none
            type(rigid_body), intent(in) :: body
            real(wp), intent(in) :: h
            real(wp), intent(inout) :: m(3), q(4)
            real(wp), intent(out) :: transition(6, 6)
            integer, intent(out), optional :: stat
            !> By the elements 11, 22, 33, 12, 13, 23; the last three change both of their places.
            real(wp), intent(out) :: by_tensor(6, 6)
        end subroutine tangent_and_tensor

        !> n equal bodies, in blocks that fill SIMD lanes. A body that is refused keeps its state and the
        !> others go on; `stat` then tells why (the largest code, if there are several).
        module subroutine tangent_of_states(body, h, m, q, transition, stat)
            implicit none
            type(rigid_body), intent(in) :: body
            real(wp), intent(in) :: h
            real(wp), intent(inout), contiguous :: m(:, :)              !! (3, n)
            real(wp), intent(inout), contiguous :: q(:, :)              !! (4, n)
            real(wp), intent(out), contiguous :: transition(:, :, :)    !! (6, 6, n)
            integer, intent(out), optional :: stat
        end subroutine tangent_of_states
    end interface flow_tangent

contains

    !> The body with the given principal moments.
    pure function body_from_moments(moments) result(body)
        real(wp), intent(in) :: moments(3)      !! I1, I2, I3, in any order
        type(rigid_body) :: body

        body%core = core_from_moments(moments)
    end function body_from_moments

    !> The body with the given inertia tensor.
    function body_from_tensor(tensor) result(body)
        real(wp), intent(in) :: tensor(3, 3)    !! symmetric, positive definite or that of a linear rotor
        type(rigid_body) :: body

        body%core = core_from_tensor(tensor)
    end function body_from_tensor

    !> `status_ok`, or why the body could not be made.
    elemental function status_of_body(self) result(status)
        class(rigid_body), intent(in) :: self
        integer :: status

        status = self%core%status
    end function status_of_body

    !> Principal moments, in the order given, or in that of the columns of `axes`; 0 for a body not made.
    pure function moments_of_body(self) result(moments)
        class(rigid_body), intent(in) :: self
        real(wp) :: moments(3)

        moments = self%core%moments
    end function moments_of_body

    !> Rotation from principal axes to those of the body: its columns are the principal axes.
    pure function axes_of_body(self) result(axes)
        class(rigid_body), intent(in) :: self
        real(wp) :: axes(3, 3)

        axes = axes_of(self%core)
    end function axes_of_body

    !> Whether the body is a linear rotor: one moment is 0.
    elemental function body_is_linear(self) result(linear)
        class(rigid_body), intent(in) :: self
        logical :: linear

        linear = self%core%linear
    end function body_is_linear

    !> The cores of bodies, in place: `bodies%core` as an argument would be copied. For library modules.
    function cores_of(bodies) result(cores)
        type(rigid_body), intent(in), target :: bodies(:)
        type(body_core), pointer :: cores(:)

        cores => bodies%core
    end function cores_of

    !> The core of one body as an array, in place: to copy it takes as long as a third of a step.
    function core_alone(body) result(cores)
        type(rigid_body), intent(in), target :: body
        type(body_core), pointer :: cores(:)

        call c_f_pointer(c_loc(body%core), cores, [1])
    end function core_alone

    !> The constants of the body, for the other modules of the library.
    elemental function core_of(body) result(core)
        type(rigid_body), intent(in) :: body
        type(body_core) :: core

        core = body%core
    end function core_of

    !> Advances the momentum of one body: no integral of the third kind, no attitude cost.
    pure subroutine flow_momentum(body, h, m, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h               !! time, any sign
        real(wp), intent(inout) :: m(3)         !! body angular momentum
        integer, intent(out) :: stat

        call flow_body(body%core, h, m, stat)
    end subroutine flow_momentum

    !> The same; stops where `stat` would not be `status_ok`.
    subroutine flow_momentum_or_stop(body, h, m)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        integer :: code

        call flow_body(body%core, h, m, code)
        if (code /= status_ok) call return_or_stop(code, 'free_flow')
    end subroutine flow_momentum_or_stop

    !> Advances the momentum and the attitude quaternion of one body.
    pure subroutine flow_quaternion(body, h, m, q, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h               !! time, any sign
        real(wp), intent(inout) :: m(3)         !! body angular momentum
        real(wp), intent(inout) :: q(4)         !! attitude, scalar first, body to space; not zero
        integer, intent(out) :: stat

        call flow_body(body%core, h, m, stat, q)
    end subroutine flow_quaternion

    !> The same; stops where `stat` would not be `status_ok`.
    subroutine flow_quaternion_or_stop(body, h, m, q)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        real(wp), intent(inout) :: q(4)
        integer :: code

        call flow_body(body%core, h, m, code, q)
        if (code /= status_ok) call return_or_stop(code, 'free_flow')
    end subroutine flow_quaternion_or_stop

    !> Advances the momentum and the attitude matrix of one body.
    pure subroutine flow_matrix(body, h, m, a, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h               !! time, any sign
        real(wp), intent(inout) :: m(3)         !! body angular momentum
        real(wp), intent(inout) :: a(3, 3)      !! attitude, body to space
        integer, intent(out) :: stat
        real(wp) :: q(4)

        stat = status_bad_attitude
        if (.not. all(ieee_is_finite(a))) return
        q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        call flow_body(body%core, h, m, stat, q)
        if (stat == status_ok) call turn_matrix(q, a)
    end subroutine flow_matrix

    !> a + a (E(q) - 1) for a turn q, E(q) - 1 = 2 q0 hat(q) + 2 hat(q)^2, small when the turn is.
    pure subroutine turn_matrix(q, a)
        real(wp), intent(in) :: q(4)
        real(wp), intent(inout) :: a(3, 3)
        real(wp) :: change(3, 3)

        change(1, 1) = -2*(q(3)*q(3) + q(4)*q(4))
        change(2, 1) = 2*(q(2)*q(3) + q(1)*q(4))
        change(3, 1) = 2*(q(2)*q(4) - q(1)*q(3))
        change(1, 2) = 2*(q(2)*q(3) - q(1)*q(4))
        change(2, 2) = -2*(q(2)*q(2) + q(4)*q(4))
        change(3, 2) = 2*(q(3)*q(4) + q(1)*q(2))
        change(1, 3) = 2*(q(2)*q(4) + q(1)*q(3))
        change(2, 3) = 2*(q(3)*q(4) - q(1)*q(2))
        change(3, 3) = -2*(q(2)*q(2) + q(3)*q(3))
        a = a + matmul(a, change)
    end subroutine turn_matrix

    !> The same; stops where `stat` would not be `status_ok`.
    subroutine flow_matrix_or_stop(body, h, m, a)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3)
        real(wp), intent(inout) :: a(3, 3)
        integer :: code

        call flow_matrix(body, h, m, a, code)
        if (code /= status_ok) call return_or_stop(code, 'free_flow')
    end subroutine flow_matrix_or_stop

    !> Advances the momenta of n equal bodies.
    subroutine flow_momenta(body, h, m, stat)
        type(rigid_body), intent(in), target :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout), contiguous :: m(:, :)      !! (3, n)
        integer, intent(out), optional :: stat

        call flow_many(core_alone(body), .true., [h], size(m, 2), m, stat)
    end subroutine flow_momenta

    !> Advances the momenta and attitudes of n equal bodies, in blocks that fill SIMD lanes. A body that is
    !> refused keeps its state and the others go on; `stat` then tells why (the largest code of several).
    subroutine flow_quaternions(body, h, m, q, stat)
        type(rigid_body), intent(in), target :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout), contiguous :: m(:, :)      !! (3, n)
        real(wp), intent(inout), contiguous :: q(:, :)      !! (4, n)
        integer, intent(out), optional :: stat

        call flow_many(core_alone(body), .true., [h], size(m, 2), m, stat, q)
    end subroutine flow_quaternions

    !> Advances the momenta of the n bodies body(:).
    subroutine flow_momenta_of_bodies(body, h, m, stat)
        type(rigid_body), intent(in), target :: body(:)     !! (n)
        real(wp), intent(in) :: h
        real(wp), intent(inout), contiguous :: m(:, :)      !! (3, n)
        integer, intent(out), optional :: stat

        call flow_many(cores_of(body), .false., [h], size(body), m, stat)
    end subroutine flow_momenta_of_bodies

    !> Advances the momenta and attitudes of the n bodies body(:).
    subroutine flow_quaternions_of_bodies(body, h, m, q, stat)
        type(rigid_body), intent(in), target :: body(:)     !! (n)
        real(wp), intent(in) :: h
        real(wp), intent(inout), contiguous :: m(:, :)      !! (3, n)
        real(wp), intent(inout), contiguous :: q(:, :)      !! (4, n)
        integer, intent(out), optional :: stat

        call flow_many(cores_of(body), .false., [h], size(body), m, stat, q)
    end subroutine flow_quaternions_of_bodies

end module frb_free_flow
