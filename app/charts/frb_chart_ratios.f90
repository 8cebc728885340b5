!> The table `heavy-top-ratios`: time that solvers need for a given error of the attitude of a heavy top, and
!> ratios of these times. One run gives all times of a row, the solvers in turn.
module frb_chart_ratios
    use frb, only: wp
    use frb_chart_output, only: chart_file, settings, open_table, progress
    use frb_chart_solvers, only: solver, top_at_start, setting_of, run_solver, one_top
    use frb_top_truth, only: qp, taylor_top
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_value, ieee_quiet_nan
    implicit none
    private

    public :: chart_ratios

    integer, parameter :: durations(2) = [10, 100]
    real(wp), parameter :: errors_wanted(3) = [1.0e-6_wp, 1.0e-9_wp, 1.0e-12_wp]
    integer, parameter :: count_of_settings = 65
    type(solver), parameter :: solvers(8) = [solver('extrapolate'), solver('scalar torque'), &
        solver('dop853'), solver('srkn14', 'flow'), solver('fg6a', 'flow'), solver('aba864', 'flow'), &
        solver('fg6b', 'flow'), solver('fg8', 'flow')]
    integer, parameter :: extrapolated = 1, scalar = 2, dop853 = 3, srkn14 = 4, fg6a = 5, aba864 = 6, fg6b = 7

contains

    subroutine chart_ratios(options)
        type(settings), intent(in) :: options
        type(chart_file) :: file
        integer :: number, i

        call open_table(options, 'heavy-top-ratios', 'heavy tops to an error of the attitude at T; '// &
            'splittings with joined drifts', 'top, T, error; time [us] of extrapolate, of the same with '// &
            'a scalar torque only, dop853, srkn14, fg6a, aba864, fg6b, fg8; ratios extrapolate/dop853, '// &
            'scalar/dop853, fg6a/srkn14, fg6b/aba864', file)
        do number = 1, 2
            do i = 1, size(durations)
                call time_solvers(options, one_top(number), durations(i), file)
                call progress(options, 'ratios', 2*(number - 1) + i, 4)
            end do
        end do
        call file%finish()
    end subroutine chart_ratios

    !> All solvers and settings on one top.
    subroutine time_solvers(options, top, span, file)
        type(settings), intent(in) :: options
        type(top_at_start), intent(in) :: top
        integer, intent(in) :: span
        type(chart_file), intent(inout) :: file
        real(wp), parameter :: enough = 0.3e-3_wp
        real(qp) :: m_end(3), q_end(4)
        real(wp) :: m(3), q(4), torques, duration, seconds
        real(wp), dimension(count_of_settings, size(solvers)) :: errors, setting, times
        integer :: rounds(count_of_settings, size(solvers)), i, k, r

        duration = real(span, wp)
        m_end = top%m0
        q_end = top%q0
        call taylor_top(real(top%moments, qp), real(top%force, qp), real(span, qp), m_end, q_end)
        do i = 1, size(solvers)
            do k = 1, count_of_settings
                setting(k, i) = finer_setting(solvers(i), top, k)
                call run_solver(solvers(i), top, duration, setting(k, i), 1, m, q, times(k, i), torques)
                errors(k, i) = 10.0_wp
                if (all(ieee_is_finite(q))) then
                    errors(k, i) = max(1.0e-17_wp, real(2*min(norm2(q - q_end), norm2(q + q_end)), wp))
                end if
                rounds(k, i) = max(1, min(1000, int(enough/max(times(k, i), 1.0e-7_wp))))
            end do
        end do
        times = huge(times)
        do r = 1, merge(2, 25, options%quick)
            do k = 1, count_of_settings
                do i = 1, size(solvers)
                    call run_solver(solvers(i), top, duration, setting(k, i), rounds(k, i), m, q, seconds, &
                                    torques)
                    times(k, i) = min(times(k, i), seconds)
                end do
            end do
        end do
        do k = 1, size(errors_wanted)
            call row(top, span, errors_wanted(k), errors, times, file)
        end do
    end subroutine time_solvers

    !> The k-th of the finer settings: a tolerance, or a step.
    pure function finer_setting(which, top, k) result(setting)
        type(solver), intent(in) :: which
        type(top_at_start), intent(in) :: top
        integer, intent(in) :: k
        real(wp) :: setting

        if (which%drift == '') then
            setting = 10.0_wp**(-0.25_wp*(k - 1))
        else
            setting = setting_of(which, top, 1)*1.08_wp**(1 - k)
        end if
    end function finer_setting

    subroutine row(top, span, wanted, errors, times, file)
        type(top_at_start), intent(in) :: top
        integer, intent(in) :: span
        real(wp), intent(in) :: wanted, errors(:, :), times(:, :)
        type(chart_file), intent(inout) :: file
        real(wp) :: us(size(solvers))
        integer :: i

        us = [(1.0e6_wp*time_to(wanted, errors(:, i), times(:, i)), i=1, size(solvers))]
        write (file%line, '(a8,i5,es8.0,8f9.2,4f7.2)') top%name, span, wanted, us, &
            us(extrapolated)/us(dop853), us(scalar)/us(dop853), us(fg6a)/us(srkn14), us(fg6b)/us(aba864)
        call file%put()
    end subroutine row

    !> Time to an error: interpolated on logarithmic scales between the fastest setting that reaches the error
    !> and the best of all faster settings; NaN where no setting reaches it.
    pure function time_to(wanted, errors, times) result(time)
        real(wp), intent(in) :: wanted, errors(:), times(:)
        real(wp) :: time
        integer :: worse, better

        time = ieee_value(time, ieee_quiet_nan)
        if (.not. any(errors <= wanted)) return
        better = minloc(times, dim=1, mask=errors <= wanted)
        time = times(better)
        if (.not. any(times < time)) return
        worse = minloc(errors, dim=1, mask=times < time)
        time = time*(times(worse)/time)**(log(wanted/errors(better))/log(errors(worse)/errors(better)))
    end function time_to

end module frb_chart_ratios
