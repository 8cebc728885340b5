!> Heat baths for rigid bodies: the exact step of friction and noise, to be put between drifts and kicks.
module frb_thermostats
    use frb_free_flow, only: core_of, rigid_body
    use frb_inertia, only: body_core, from_principal, to_principal
    use frb_kinds, only: wp
    use frb_status, only: return_or_stop, status_ok, status_bad_count, status_bad_momentum, &
        status_bad_option, status_bad_time
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
    implicit none
    private

    public :: langevin_kick

    !> The Ornstein-Uhlenbeck process dm_k = -gamma_k m_k dt + sqrt(2 gamma_k kT I_k) dW_k of the body angular
    !> momentum, exactly over the time dt:
    !>
    !>     m_k <- e^(-gamma_k dt) m_k + sqrt(kT I_k (1 - e^(-2 gamma_k dt))) noise_k
    !>
    !> `call langevin_kick(body, friction, temperature, dt, noise, m, stat)` with m(3), or m(3, n) and the
    !> body one for all or body(n). k are the principal axes, in the order of body%moments(): for a body by
    !> moments the body axes, for one by a tensor the columns of body%axes(). `friction` is a rate, one for
    !> all axes or friction(3), >= 0; `temperature` is kT >= 0, in the units of m^2/I; `noise`, of the shape
    !> of m, holds independent standard normal numbers of the caller. It keeps the canonical distribution,
    !> <m_k^2> = kT I_k, whatever dt >= 0. About the axis of a linear rotor m is set to 0.
    !>
    !> BAOAB (Leimkuhler and Matthews 2013) with the exact drift: kick h/2, free_flow h/2, langevin_kick h,
    !> free_flow h/2, kick h/2.
    !>
    !> `stat`, m untouched: the status of a body that could not be made; `status_bad_option` for friction or
    !> temperature negative or not finite; `status_bad_time` for dt negative or not finite;
    !> `status_bad_momentum` for m or noise not finite; `status_bad_count` for sizes that do not match.
    interface langevin_kick
        module procedure kick_body
        module procedure kick_body_axes
        module procedure kick_alike
        module procedure kick_alike_axes
        module procedure kick_bodies
        module procedure kick_bodies_axes
    end interface langevin_kick

contains

    !> One body, one friction.
    subroutine kick_body(body, friction, temperature, dt, noise, m, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: friction, temperature, dt
        real(wp), intent(in) :: noise(3)
        real(wp), intent(inout) :: m(3)
        integer, intent(out), optional :: stat

        call kick_body_axes(body, spread(friction, 1, 3), temperature, dt, noise, m, stat)
    end subroutine kick_body

    !> One body, friction about each axis.
    subroutine kick_body_axes(body, friction, temperature, dt, noise, m, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: friction(3), temperature, dt
        real(wp), intent(in) :: noise(3)
        real(wp), intent(inout) :: m(3)
        integer, intent(out), optional :: stat
        real(wp) :: all_m(3, 1)

        all_m(:, 1) = m
        call kick_bodies_axes([body], friction, temperature, dt, reshape(noise, [3, 1]), all_m, stat)
        m = all_m(:, 1)
    end subroutine kick_body_axes

    !> n bodies that are alike, one friction.
    subroutine kick_alike(body, friction, temperature, dt, noise, m, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: friction, temperature, dt
        real(wp), intent(in), contiguous :: noise(:, :)
        real(wp), intent(inout), contiguous :: m(:, :)
        integer, intent(out), optional :: stat

        call kick_bodies_axes([body], spread(friction, 1, 3), temperature, dt, noise, m, stat)
    end subroutine kick_alike

    !> n bodies that are alike, friction about each axis.
    subroutine kick_alike_axes(body, friction, temperature, dt, noise, m, stat)
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: friction(3), temperature, dt
        real(wp), intent(in), contiguous :: noise(:, :)
        real(wp), intent(inout), contiguous :: m(:, :)
        integer, intent(out), optional :: stat

        call kick_bodies_axes([body], friction, temperature, dt, noise, m, stat)
    end subroutine kick_alike_axes

    !> n bodies, one friction.
    subroutine kick_bodies(body, friction, temperature, dt, noise, m, stat)
        type(rigid_body), intent(in) :: body(:)
        real(wp), intent(in) :: friction, temperature, dt
        real(wp), intent(in), contiguous :: noise(:, :)
        real(wp), intent(inout), contiguous :: m(:, :)
        integer, intent(out), optional :: stat

        call kick_bodies_axes(body, spread(friction, 1, 3), temperature, dt, noise, m, stat)
    end subroutine kick_bodies

    !> n bodies or one for all, friction about each axis.
    subroutine kick_bodies_axes(body, friction, temperature, dt, noise, m, stat)
        type(rigid_body), intent(in) :: body(:)
        real(wp), intent(in) :: friction(3), temperature, dt
        real(wp), intent(in), contiguous :: noise(:, :)
        real(wp), intent(inout), contiguous :: m(:, :)
        integer, intent(out), optional :: stat
        type(body_core) :: core
        real(wp) :: decay(3), width(3), sigma(3), along(3), x
        integer :: code, i, k

        code = maxval([status_ok, body%status()])
        if (code == status_ok) code = first_fault(size(body), friction, temperature, dt, noise, m)
        if (code == status_ok) then
            do k = 1, 3
                x = 4096.0_wp
                if (exponent(friction(k)) + exponent(dt) <= 12) x = friction(k)*dt
                decay(k) = exp(-x)
                ! 1 - e^(-2x), to the last digits for small x.
                width(k) = sqrt(2*tanh(x)/(1 + tanh(x)))
            end do
            do i = 1, size(m, 2)
                if (i <= size(body)) then
                    core = core_of(body(i))
                    sigma = sqrt(temperature)*sqrt(core%moments)*width
                end if
                if (core%needs_rotation) then
                    along = to_principal(core, m(:, i))
                    along = decay*along + sigma*noise(:, i)
                    where (.not. core%moments > 0.0_wp) along = 0.0_wp
                    m(:, i) = from_principal(core, along)
                else
                    m(:, i) = decay*m(:, i) + sigma*noise(:, i)
                end if
            end do
        end if
        call return_or_stop(code, 'langevin_kick', stat)
    end subroutine kick_bodies_axes

    !> `status_ok`, or the code of the first error.
    pure function first_fault(bodies, friction, temperature, dt, noise, m) result(code)
        integer, intent(in) :: bodies
        real(wp), intent(in) :: friction(3), temperature, dt, noise(:, :), m(:, :)
        integer :: code

        code = status_bad_count
        if (size(m, 1) /= 3 .or. any(shape(noise) /= shape(m))) return
        if (bodies /= 1 .and. bodies /= size(m, 2)) return
        code = status_bad_option
        if (.not. (all(ieee_is_finite(friction)) .and. ieee_is_finite(temperature))) return
        if (any(friction < 0.0_wp) .or. temperature < 0.0_wp) return
        code = status_bad_time
        if (.not. ieee_is_finite(dt)) return
        if (dt < 0.0_wp) return
        code = status_bad_momentum
        if (.not. (all(ieee_is_finite(m)) .and. all(ieee_is_finite(noise)))) return
        code = status_ok
    end function first_fault

end module frb_thermostats
