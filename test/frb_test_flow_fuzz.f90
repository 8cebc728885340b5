!> free_flow: a fuzz over bodies, momenta and steps of all sizes.
module frb_test_flow_fuzz
    use, intrinsic :: iso_fortran_env, only: int64, output_unit
    use frb_checks, only: tally, worst_of
    use frb_flow_samples, only: stream, advanced, made_finite, defect, near_separatrix, no_turn
    use frb_free_flow, only: free_flow, rigid_body
    use frb_kinds, only: wp, unit_roundoff
    use frb_rotations, only: norm3
    implicit none
    private

    public :: test_flow_fuzz

    real(wp), parameter :: eps = epsilon(1.0_wp)
    !> Norms and energy (relative to |m|^2/(2 I1)) after one step; momentum in space. Measured 8 and 33 eps.
    real(wp), parameter :: on_the_orbit = 8*eps
    real(wp), parameter :: in_space = 64*eps
    !> The same errors where a deviation grows by 1e4 or more: next to the separatrix, over many decay times.
    real(wp), parameter :: next_to_separatrix = 1.0e-11_wp
    !> Error of a step there and back, and difference of a batch from one body at a time, in units of a rough
    !> inherent sensitivity; measured 16 and 0.4.
    real(wp), parameter :: returned = 40.0_wp
    real(wp), parameter :: same_in_batch = 2.0_wp
    real(wp), parameter :: most_sensitive = 1.0e-11_wp

contains

    subroutine test_flow_fuzz(t)
        type(tally), intent(inout) :: t

        call t%open_suite('flow-fuzz', 8)
        call check_fuzz(t)
        call t%close_suite()
    end subroutine test_flow_fuzz

    !> Any body, momentum and step: moments over 12 decades, symmetric and nearly so; momenta next to axes and
    !> to the separatrix; steps over 20 decades. FRB_SEED in the environment asks for other cases.
    subroutine check_fuzz(t)
        type(tally), intent(inout) :: t
        integer, parameter :: cases = 4000
        integer, parameter :: width = 40
        type(stream) :: random
        character(20) :: seed
        real(wp) :: moments(3), m(3), h, there(7), back(7), orbit(4), error, batch, sensitive, unit, alone(7)
        real(wp) :: many_m(3, width), many_q(4, width), many_moments(3, width), many_m0(3, width)
        type(rigid_body) :: bodies(width)
        logical :: finite
        integer :: i, j, io, length

        random%state = 20081
        call get_environment_variable('FRB_SEED', seed, length, io)
        if (io == 0 .and. length > 0) read (seed, *, iostat=io) random%state
        random%state = 1 + modulo(random%state, 2147483646_int64)
        write (output_unit, '(a,i0)') '  fuzz with seed ', random%state - 1
        orbit = 0.0_wp
        error = 0.0_wp
        batch = 0.0_wp
        sensitive = 0.0_wp
        finite = .true.
        do i = 1, cases
            call draw(random, moments, m)
            h = sign(random%log_uniform(-15.0_wp, 5.0_wp), random%uniform(-1.0_wp, 1.0_wp)) &
                *(minval(moments)/norm3(m))
            there = advanced(moments, m, h)
            finite = finite .and. there(1) < 1.0e30_wp
            back = advanced(moments, there(1:3), -h, there(4:7))
            unit = sensitivity(moments, m, h) + sensitivity(moments, there(1:3), -h)
            if (unit < most_sensitive) then
                orbit = worst_of(orbit, bounded(defect(moments, m, there), moments, m))
            else
                sensitive = worst_of(sensitive, bounded(defect(moments, m, there), moments, m))
            end if
            if (unit < most_sensitive) error = worst_of(error, [norm3(back(1:3) - m)/norm3(m)/unit, &
                                                   norm2(back(4:7) - no_turn)/unit])
        end do
        do i = 1, cases/width/4
            h = random%log_uniform(-8.0_wp, 5.0_wp)
            do j = 1, width
                call draw(random, many_moments(:, j), many_m0(:, j))
                bodies(j) = rigid_body(many_moments(:, j))
            end do
            many_m = many_m0
            many_q = spread(no_turn, 2, width)
            call free_flow(bodies, h, many_m, many_q)
            do j = 1, width
                there = made_finite([many_m(:, j), many_q(:, j)])
                alone = advanced(many_moments(:, j), many_m0(:, j), h)
                sensitive = worst_of(sensitive, bounded(defect(many_moments(:, j), many_m0(:, j), there), &
                                                    many_moments(:, j), many_m0(:, j)))
                unit = sensitivity(many_moments(:, j), many_m0(:, j), h)
                if (unit < most_sensitive) batch = worst_of(batch, [norm2(there(4:7) - alone(4:7))/unit, &
                                                       norm3(there(1:3) - alone(1:3))/norm3(alone(1:3))/unit])
            end do
        end do
        call t%ok('fuzz-stays-finite', finite)
        call t%at_most('fuzz-keeps-q-unit', orbit(1), on_the_orbit)
        call t%at_most('fuzz-keeps-the-norm-of-m', orbit(2), on_the_orbit)
        call t%at_most('fuzz-keeps-the-energy', orbit(3), on_the_orbit)
        call t%at_most('fuzz-keeps-the-momentum-in-space', orbit(4), in_space)
        call t%at_most('fuzz-next-to-the-separatrix-stays-close-to-the-orbit', sensitive, next_to_separatrix)
        call t%at_most('fuzz-there-and-back', error, returned)
        call t%at_most('fuzz-batches-agree-with-one-by-one', batch, same_in_batch)
    end subroutine check_fuzz

    !> The next body and momentum.
    subroutine draw(random, moments, m)
        type(stream), intent(inout) :: random
        real(wp), intent(out) :: moments(3), m(3)
        integer :: i, j, k, axis

        i = int(random%uniform(0.0_wp, 6.0_wp))
        j = 1 + int(random%uniform(0.0_wp, 3.0_wp))
        k = 1 + mod(j, 3)
        moments = random%triangle()
        if (mod(i, 2) == 0) then
            do axis = 1, 3
                moments(axis) = random%log_uniform(-6.0_wp, 6.0_wp)
            end do
        end if
        if (i == 2) moments(j) = moments(k)
        if (i == 3) moments(j) = moments(k)*(1 + random%log_uniform(-16.0_wp, -3.0_wp))
        if (i == 4) moments = moments(j)
        m = random%direction()
        if (i == 1) m = near_separatrix(random, moments, random%log_uniform(-16.0_wp, 0.0_wp))
        if (i == 5) then
            m = m*random%log_uniform(-20.0_wp, -1.0_wp)
            m(k) = 1.0_wp
        end if
        m = m*random%log_uniform(-10.0_wp, 10.0_wp)
    end subroutine draw

    !> The defects, with the defect of the energy relative to the largest energy for |m|, |m|^2/(2 I1).
    pure function bounded(defects, moments, m) result(scaled)
        real(wp), intent(in) :: defects(4), moments(3), m(3)
        real(wp) :: scaled(4)

        scaled = defects
        scaled(3) = defects(3)*sum((m/norm3(m))**2*(minval(moments)/moments))
    end function bounded

    !> How far m/|m| and q may move when momentum and moments move by 2^-53, there and back: the angle turned,
    !> and the growth of deviations along the orbit, from the motions 1e-7 beside. No more than 1e-9 is known.
    function sensitivity(moments, m, h) result(unit)
        real(wp), intent(in) :: moments(3), m(3), h
        real(wp) :: unit
        real(wp), parameter :: beside = 1.0e-7_wp
        real(wp) :: alone(7), other(7), moved_m(3), moved(3)
        integer :: i, axis

        alone = advanced(moments, m, h)
        unit = 2 + abs(h)*norm3(m)/minval(moments)
        do i = 1, 6
            axis = 1 + mod(i, 3)
            moved_m = m
            moved = moments
            if (i <= 3) then
                moved_m(axis) = moved_m(axis) + beside*norm3(m)
            else
                moved(axis) = moved(axis)*(1 + beside)
            end if
            other = advanced(moved, moved_m, h)
            unit = max(unit, norm3(other(1:3) - alone(1:3))/(beside*norm3(m)), &
                       norm2(other(4:7) - alone(4:7))/beside)
        end do
        unit = 2*unit*unit_roundoff
    end function sensitivity

end module frb_test_flow_fuzz
