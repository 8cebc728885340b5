!> Conserved quantities: energy, momentum in space, norms; and an observer that monitors them.
module frb_invariants
    use frb_free_flow, only: core_of, rigid_body
    use frb_inertia, only: to_principal
    use frb_kinds, only: wp
    use frb_rotations, only: quat_rotate
    use frb_status, only: status_ok
    use frb_torque, only: body_scene, group_scene, body_observer
    use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_value, ieee_quiet_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: kinetic_energy, total_energy, spatial_momentum, norm_defect, invariant_monitor

    !> T = sum of m_j^2/(2 I_j), of one body or of all: kinetic_energy(body, m). For n bodies m is (3, n),
    !> body a scalar or body(n). NaN for sizes that do not match or a body that could not be made.
    interface kinetic_energy
        module procedure kinetic_energy_of_body
        module procedure kinetic_energy_alike
        module procedure kinetic_energy_of_group
    end interface kinetic_energy

    !> T + V: total_energy(body, scene, t, m, q), of one body or of all. NaN when the scene gives no
    !> potential or refuses, and for sizes that do not match. Constant in time when the potential does not
    !> depend on time.
    interface total_energy
        module procedure total_energy_of_body
        module procedure total_energy_alike
        module procedure total_energy_of_group
    end interface total_energy

    !> Angular momentum in the space frame, Q m: spatial_momentum(m, q), of one body or summed over all. NaN
    !> for sizes that do not match or q not of norm one.
    !> Under a torque its component along an axis is constant if a turn of the body about this axis in space
    !> does not change the potential: along `force` for a heavy top.
    interface spatial_momentum
        module procedure spatial_momentum_of_body
        module procedure spatial_momentum_of_group
    end interface spatial_momentum

    !> An observer that stores the largest differences from the values at the start of the run; NaN where a
    !> value cannot be computed, as the energy of a scene without a potential.
    !> `axis` is the direction in space along which the momentum is conserved, if any.
    type, extends(body_observer) :: invariant_monitor
        type(rigid_body) :: body
        class(body_scene), allocatable :: scene
        real(wp) :: axis(3) = [0.0_wp, 0.0_wp, 1.0_wp]  !! direction in space, unit vector
        real(wp) :: energy = 0.0_wp                     !! total energy at the start
        real(wp) :: momentum = 0.0_wp                   !! axis . Q m at the start
        real(wp) :: energy_error = 0.0_wp               !! largest |T + V - energy|
        real(wp) :: momentum_error = 0.0_wp             !! largest |axis . Q m - momentum|
        real(wp) :: norm_error = 0.0_wp                 !! largest | |q| - 1 |
    contains
        procedure :: observe => monitor_body    !! takes the largest errors so far
    end type invariant_monitor

contains

    !> |q| - 1, without the loss of digits of a square root near one.
    pure function norm_defect(q) result(defect)
        real(wp), intent(in) :: q(4)
        real(wp) :: defect
        real(wp) :: square_defect

        square_defect = (q(1) - 1)*(q(1) + 1) + q(2)*q(2) + q(3)*q(3) + q(4)*q(4)
        defect = square_defect/(1 + sqrt(max(1 + square_defect, 0.0_wp)))
    end function norm_defect

    !> T of one body.
    pure function kinetic_energy_of_body(body, m) result(energy)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: m(3)    !! angular momentum, body frame
        real(wp) :: energy
        real(wp) :: along(3)

        associate (core => core_of(body))
            along = m
            if (core%needs_rotation) along = to_principal(core, m)
            energy = 0.5_wp*sum(core%a*along(core%order)**2)
            if (core%status /= status_ok) energy = ieee_value(energy, ieee_quiet_nan)
        end associate
    end function kinetic_energy_of_body

    !> T of n bodies that are alike.
    pure function kinetic_energy_alike(body, m) result(energy)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: m(:, :)     !! angular momenta (3, n), body frames
        real(wp) :: energy

        energy = kinetic_energy_of_group([body], m)
    end function kinetic_energy_alike

    !> T of n bodies.
    pure function kinetic_energy_of_group(body, m) result(energy)
        type(rigid_body), intent(in) :: body(:)     !! n bodies, or one for all
        real(wp), intent(in) :: m(:, :)             !! angular momenta (3, n), body frames
        real(wp) :: energy
        integer :: i

        energy = ieee_value(energy, ieee_quiet_nan)
        if (.not. matches(size(body), m)) return
        energy = 0.0_wp
        do i = 1, size(m, 2)
            energy = energy + kinetic_energy_of_body(body(min(i, size(body))), m(:, i))
        end do
    end function kinetic_energy_of_group

    !> Whether momenta (3, n), attitudes (4, n) and a number of bodies, 1 or n, belong together.
    pure function matches(bodies, m, q) result(good)
        integer, intent(in) :: bodies
        real(wp), intent(in) :: m(:, :)
        real(wp), intent(in), optional :: q(:, :)
        logical :: good

        good = size(m, 1) == 3 .and. (bodies == 1 .or. bodies == size(m, 2))
        if (good .and. present(q)) good = size(q, 1) == 4 .and. size(q, 2) == size(m, 2)
    end function matches

    !> T + V of one body.
    function total_energy_of_body(body, scene, t, m, q) result(energy)
        type(rigid_body), intent(in) :: body
        class(body_scene), intent(inout) :: scene
        real(wp), intent(in) :: t, m(3), q(4)
        real(wp) :: energy, v
        integer :: stat

        call scene%potential(q, t, v, stat)
        energy = kinetic_energy_of_body(body, m) + v
        if (stat /= status_ok) energy = ieee_value(v, ieee_quiet_nan)
    end function total_energy_of_body

    !> T + V of n bodies that are alike.
    function total_energy_alike(body, scene, t, m, q) result(energy)
        type(rigid_body), intent(in) :: body
        class(group_scene), intent(inout) :: scene
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(in) :: m(:, :), q(:, :)
        real(wp) :: energy

        energy = total_energy_of_group([body], scene, t, m, q)
    end function total_energy_alike

    !> T + V of n bodies.
    function total_energy_of_group(body, scene, t, m, q) result(energy)
        type(rigid_body), intent(in) :: body(:)
        class(group_scene), intent(inout) :: scene
        real(wp), intent(in) :: t
        real(wp), contiguous, intent(in) :: m(:, :), q(:, :)
        real(wp) :: energy, v
        integer :: stat

        energy = ieee_value(energy, ieee_quiet_nan)
        if (.not. matches(size(body), m, q)) return
        call scene%potential(q, t, v, stat)
        energy = kinetic_energy_of_group(body, m) + v
        if (stat /= status_ok) energy = ieee_value(v, ieee_quiet_nan)
    end function total_energy_of_group

    !> Q m of one body.
    pure function spatial_momentum_of_body(m, q) result(momentum)
        real(wp), intent(in) :: m(3), q(4)
        real(wp) :: momentum(3)

        momentum = quat_rotate(q, m)
    end function spatial_momentum_of_body

    !> Sum of Q m over n bodies.
    pure function spatial_momentum_of_group(m, q) result(momentum)
        real(wp), intent(in) :: m(:, :), q(:, :)
        real(wp) :: momentum(3)
        integer :: i

        momentum = ieee_value(momentum, ieee_quiet_nan)
        if (.not. matches(1, m, q)) return
        momentum = 0.0_wp
        do i = 1, size(m, 2)
            momentum = momentum + quat_rotate(q(:, i), m(:, i))
        end do
    end function spatial_momentum_of_group

    !> Stores the values at the start, and the largest differences from them.
    subroutine monitor_body(self, step, t, m, q, stop)
        class(invariant_monitor), intent(inout) :: self
        integer(int64), intent(in) :: step
        real(wp), intent(in) :: t, m(3), q(4)
        logical, intent(inout) :: stop
        real(wp) :: energy, momentum

        associate (unused_stop => stop)
        end associate
        momentum = dot_product(self%axis, quat_rotate(q, m))
        if (allocated(self%scene)) then
            energy = total_energy_of_body(self%body, self%scene, t, m, q)
        else
            energy = kinetic_energy_of_body(self%body, m)
        end if
        if (step == 0) then
            self%energy = energy
            self%momentum = momentum
            self%energy_error = 0.0_wp
            self%momentum_error = 0.0_wp
            self%norm_error = 0.0_wp
        end if
        call keep_larger(abs(energy - self%energy), self%energy_error)
        call keep_larger(abs(momentum - self%momentum), self%momentum_error)
        call keep_larger(abs(norm_defect(q)), self%norm_error)
    end subroutine monitor_body

    !> The larger of the error so far and a new one; NaN once one of them is NaN, which max may ignore.
    pure subroutine keep_larger(error, largest)
        real(wp), intent(in) :: error
        real(wp), intent(inout) :: largest

        if (ieee_is_nan(largest)) return
        if (ieee_is_nan(error)) then
            largest = error
        else
            largest = max(largest, error)
        end if
    end subroutine keep_larger

end module frb_invariants
